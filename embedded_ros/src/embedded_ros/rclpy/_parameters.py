# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters: declared, typed, constrained, and announced when they change."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from embedded_ros.types import message_class

from .exceptions import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from .parameter import PARAMETER_SEPARATOR_STRING, Parameter

# How far a value may be off a step of its range, as rclpy's.
_STEP_TOLERANCE = 1e-7

Callback = Callable[[list[Parameter]], Any]
Announce = Callable[[list[Parameter], list[Parameter], list[Parameter]], None]


class Parameters:
    """The parameters of one node.

    Args:
        overrides: Values from the command line and the constructor, by name.
        announce: Called with the new, changed and deleted parameters.
        allow_undeclared: Whether setting an undeclared parameter declares it.
    """

    def __init__(
        self, overrides: dict[str, Parameter], announce: Announce, allow_undeclared: bool
    ) -> None:
        self.overrides = overrides
        self.allow_undeclared = allow_undeclared
        self.pre_set_callbacks: list[Callable[[list[Parameter]], list[Parameter]]] = []
        self.on_set_callbacks: list[Callback] = []
        self.post_set_callbacks: list[Callable[[list[Parameter]], None]] = []
        self._announce = announce
        self._lock = threading.RLock()
        self._values: dict[str, Parameter] = {}
        self._descriptors: dict[str, Any] = {}

    def declare(
        self, name: str, value: Any, descriptor: Any, *, ignore_override: bool = False
    ) -> Parameter:
        """Declare a parameter.

        Args:
            name: Name of the parameter.
            value: Default of the parameter, or its type where it has none, or None.
            descriptor: An rcl_interfaces/msg/ParameterDescriptor; filled in.
            ignore_override: Whether the command line counts.

        Raises:
            ParameterAlreadyDeclaredException: It is declared.
            InvalidParameterException: The name is invalid.
            InvalidParameterTypeException: The override is of another type.
            InvalidParameterValueException: The value is rejected.
        """
        _check_name(name)
        with self._lock:
            if name in self._values:
                raise ParameterAlreadyDeclaredException(name)
            kind = value if isinstance(value, Parameter.Type) else None
            if kind is Parameter.Type.NOT_SET and not descriptor.dynamic_typing:
                raise ValueError(f"Cannot declare parameter {name} statically as NOT_SET")
            default = Parameter(name, value=None if kind else value)
            if kind is None:
                kind = default.type_
            if kind is Parameter.Type.NOT_SET:
                descriptor.dynamic_typing = True
            descriptor.name = name
            descriptor.type = (Parameter.Type.NOT_SET if descriptor.dynamic_typing else kind).value
            parameter = default
            if not ignore_override and name in self.overrides:
                parameter = _adapted(self.overrides[name], kind)
            self._check_type(parameter, descriptor, declared=True)
            self._check_range(parameter, descriptor)
            result = self._ask_callbacks([parameter])
            if not result.successful:
                raise InvalidParameterValueException(name, parameter.value, result.reason)
            self._values[name] = parameter
            self._descriptors[name] = descriptor
        self._notify([parameter], [], [])
        return parameter

    def undeclare(self, name: str) -> None:
        """Forget a parameter.

        Raises:
            ParameterNotDeclaredException: It is not declared.
            ParameterImmutableException: It is read-only.
        """
        with self._lock:
            parameter = self._declared(name)
            if self._descriptors[name].read_only:
                raise ParameterImmutableException(name)
            del self._values[name], self._descriptors[name]
        self._notify([], [], [parameter])

    def has(self, name: str) -> bool:
        """Whether a parameter is declared."""
        return name in self._values

    def names(self) -> list[str]:
        """The names of the declared parameters."""
        with self._lock:
            return list(self._values)

    def get(self, name: str) -> Parameter:
        """A parameter.

        Raises:
            ParameterNotDeclaredException: It is not declared.
            ParameterUninitializedException: It has a static type and no value yet.
        """
        with self._lock:
            if name not in self._values and self.allow_undeclared:
                return Parameter(name)
            parameter = self._declared(name)
            if (
                parameter.type_ is Parameter.Type.NOT_SET
                and not self._descriptors[name].dynamic_typing
            ):
                raise ParameterUninitializedException(name)
            return parameter

    def peek(self, name: str) -> Parameter | None:
        """A parameter, without a value where it has none; None where it is not declared."""
        return self._values.get(name)

    def descriptor(self, name: str) -> Any:
        """A parameter's descriptor; raises ParameterNotDeclaredException."""
        with self._lock:
            if name not in self._values and self.allow_undeclared:
                return message_class("rcl_interfaces/msg/ParameterDescriptor")()
            self._declared(name)
            return self._descriptors[name]

    def set_descriptor(self, name: str, descriptor: Any, alternative: Any = None) -> Any:
        """Replace a parameter's descriptor, and its value by an alternative where given."""
        with self._lock:
            parameter = self._declared(name)
            if self._descriptors[name].read_only:
                raise ParameterImmutableException(name)
            descriptor.name = name
            descriptor.type = (
                0 if descriptor.dynamic_typing else parameter.type_.value or descriptor.type
            )
            if alternative is not None:
                parameter = Parameter.from_parameter_msg(alternative)
            self._check_range(parameter, descriptor)
            self._descriptors[name] = descriptor
            self._values[name] = parameter
            return parameter.get_parameter_value()

    def set(self, parameters: Iterable[Parameter]) -> list[Any]:
        """Set parameters one by one; returns a SetParametersResult for each.

        Raises:
            ParameterNotDeclaredException: One is not declared; those before it are set.
        """
        return [self.set_atomically([parameter]) for parameter in parameters]

    def set_atomically(self, parameters: Sequence[Parameter]) -> Any:
        """Set all parameters or, where one is rejected, none.

        Returns:
            An rcl_interfaces/msg/SetParametersResult.

        Raises:
            ParameterNotDeclaredException: One is not declared.
        """
        with self._lock:
            wanted = list(parameters)
            for pre_set in self.pre_set_callbacks:
                wanted = list(pre_set(wanted))
                if not wanted:
                    return _result(False, "parameters were removed by a pre-set callback")
            undeclared = [p.name for p in wanted if p.name not in self._values]
            if undeclared and not self.allow_undeclared:
                raise ParameterNotDeclaredException(undeclared)
            result = self._check_all(wanted)
            if not result.successful:
                return result
            new, changed, deleted = self._apply(wanted)
        self._notify(new, changed, deleted)
        for post_set in self.post_set_callbacks:
            post_set(wanted)
        return result

    def listed(self, prefixes: Sequence[str], depth: int) -> Any:
        """The names below prefixes, as an rcl_interfaces/msg/ListParametersResult.

        Args:
            prefixes: All names where there are none.
            depth: How many levels below a prefix, 0 for any number.

        Raises:
            TypeError: Prefixes are no sequence of strings.
            ValueError: The depth is negative.
        """
        if isinstance(prefixes, str) or any(not isinstance(p, str) for p in prefixes):
            raise TypeError("prefixes must be a sequence of strings")
        if depth < 0:
            raise ValueError(f"depth is {depth}, expected at least 0")
        result: Any = message_class("rcl_interfaces/msg/ListParametersResult")()
        for name in self.names():
            if not _listed(name, prefixes, depth):
                continue
            result.names.append(name)
            prefix = name.rpartition(PARAMETER_SEPARATOR_STRING)[0]
            if prefix and prefix not in result.prefixes:
                result.prefixes.append(prefix)
        return result

    def _apply(
        self, parameters: Sequence[Parameter]
    ) -> tuple[list[Parameter], list[Parameter], list[Parameter]]:
        new: list[Parameter] = []
        changed: list[Parameter] = []
        deleted: list[Parameter] = []
        for parameter in parameters:
            name = parameter.name
            if name not in self._values:
                descriptor: Any = message_class("rcl_interfaces/msg/ParameterDescriptor")()
                descriptor.name, descriptor.dynamic_typing = name, True
                self._descriptors[name] = descriptor
                new.append(parameter)
            elif parameter.type_ is Parameter.Type.NOT_SET:
                # Setting no value deletes a dynamically typed parameter.
                deleted.append(self._values.pop(name))
                del self._descriptors[name]
                continue
            else:
                changed.append(parameter)
            self._values[name] = parameter
        return new, changed, deleted

    def _check_all(self, parameters: Sequence[Parameter]) -> Any:
        for index, parameter in enumerate(parameters):
            descriptor = self._descriptors.get(parameter.name)
            if descriptor is None:
                continue
            if descriptor.read_only:
                return _result(False, f"Trying to set a read-only parameter: {parameter.name}.")
            adapted = _adapted(parameter, Parameter.Type(descriptor.type))
            if adapted is not parameter and isinstance(parameters, list):
                parameters[index] = adapted
            try:
                self._check_type(adapted, descriptor)
                self._check_range(adapted, descriptor)
            except (InvalidParameterTypeException, InvalidParameterValueException) as error:
                return _result(False, str(error))
        return self._ask_callbacks(list(parameters))

    def _ask_callbacks(self, parameters: list[Parameter]) -> Any:
        for callback in self.on_set_callbacks:
            result = callback(parameters)
            if not result.successful:
                return result
        return _result(True)

    def _declared(self, name: str) -> Parameter:
        try:
            return self._values[name]
        except KeyError:
            raise ParameterNotDeclaredException(name) from None

    @staticmethod
    def _check_type(parameter: Parameter, descriptor: Any, declared: bool = False) -> None:
        if descriptor.dynamic_typing or parameter.type_.value == descriptor.type:
            return
        if declared and parameter.type_ is Parameter.Type.NOT_SET:
            return  # declared with a type and no value
        raise InvalidParameterTypeException(parameter, Parameter.Type(descriptor.type).name)

    @staticmethod
    def _check_range(parameter: Parameter, descriptor: Any) -> None:
        ranges = {
            Parameter.Type.INTEGER: descriptor.integer_range,
            Parameter.Type.DOUBLE: descriptor.floating_point_range,
        }.get(parameter.type_)
        for limits in ranges or ():
            value, low, high, step = (
                parameter.value,
                limits.from_value,
                limits.to_value,
                limits.step,
            )
            if not low <= value <= high and value not in (low, high):
                raise InvalidParameterValueException(
                    parameter.name, value, f"not in the range [{low}, {high}]"
                )
            off = (value - low) / step if step else 0
            if value != high and abs(off - round(off)) > _STEP_TOLERANCE:
                raise InvalidParameterValueException(
                    parameter.name, value, f"no multiple of step {step} above {low}"
                )

    def _notify(
        self, new: list[Parameter], changed: list[Parameter], deleted: list[Parameter]
    ) -> None:
        if new or changed or deleted:
            self._announce(new, changed, deleted)


def _adapted(parameter: Parameter, kind: Parameter.Type) -> Parameter:
    """An empty list has no type of its own: it takes on the declared one."""
    if kind.value >= Parameter.Type.BYTE_ARRAY.value and parameter.type_ is not kind:
        value = parameter.value
        if isinstance(value, list | tuple) and not value:
            return Parameter(parameter.name, kind, [])
    return parameter


def _check_name(name: str) -> None:
    if not isinstance(name, str) or not name:
        raise InvalidParameterException(str(name))


def _listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    separator = PARAMETER_SEPARATOR_STRING
    if not prefixes:
        return depth == 0 or name.count(separator) < depth
    for prefix in prefixes:
        if name == prefix:
            return True
        if name.startswith(prefix + separator):
            below = name[len(prefix) + 1 :].count(separator)
            if depth == 0 or below < depth:
                return True
    return False


def _result(successful: bool, reason: str = "") -> Any:
    cls: Any = message_class("rcl_interfaces/msg/SetParametersResult")
    return cls(successful=successful, reason=reason)
