# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters as values."""

from __future__ import annotations

import array
from collections.abc import Iterable, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from embedded_ros.types import message_class

from ._arguments import parse_arguments

PARAMETER_SEPARATOR_STRING = "."

_VALUE_FIELDS = {
    1: "bool_value",
    2: "integer_value",
    3: "double_value",
    4: "string_value",
    5: "byte_array_value",
    6: "bool_array_value",
    7: "integer_array_value",
    8: "double_array_value",
    9: "string_array_value",
}
_SCALAR_TYPES: dict[int, type] = {1: bool, 2: int, 3: float, 4: str}
_ELEMENT_TYPES: dict[int, type] = {5: bytes, 6: bool, 7: int, 8: float, 9: str}


class Parameter:
    """A parameter: name, type and value."""

    class Type(Enum):
        """A parameter's type, numbered as in rcl_interfaces/msg/ParameterType."""

        NOT_SET = 0
        BOOL = 1
        INTEGER = 2
        DOUBLE = 3
        STRING = 4
        BYTE_ARRAY = 5
        BOOL_ARRAY = 6
        INTEGER_ARRAY = 7
        DOUBLE_ARRAY = 8
        STRING_ARRAY = 9

        @classmethod
        def from_parameter_value(cls, parameter_value: Any) -> Parameter.Type:
            """The type of a Python value; raises TypeError where it has none."""
            if parameter_value is None:
                return cls.NOT_SET
            for kind in cls:
                if kind is not cls.NOT_SET and kind.check(parameter_value):
                    return kind
            raise TypeError(f"The given value {parameter_value!r} is not one of the allowed types")

        def check(self, parameter_value: Any) -> bool:
            """Whether a Python value is of this type."""
            if self is Parameter.Type.NOT_SET:
                return parameter_value is None
            scalar = _SCALAR_TYPES.get(self.value)
            if scalar is not None:
                return _is_exactly(parameter_value, scalar)
            if not isinstance(parameter_value, list | tuple | array.array):
                return False
            element = _ELEMENT_TYPES[self.value]
            return all(_is_exactly(item, element) for item in parameter_value)

    def __init__(self, name: str, type_: Parameter.Type | None = None, value: Any = None) -> None:
        if type_ is None:
            type_ = Parameter.Type.from_parameter_value(value)
        if not isinstance(type_, Parameter.Type):
            raise TypeError("type must be an instance of `Parameter.Type`")
        if not type_.check(value):
            raise ValueError(f"Type '{type_}' and value '{value}' do not agree")
        self._name = name
        self._type_ = type_
        self._value = value

    @classmethod
    def from_parameter_msg(cls, param_msg: Any) -> Parameter:
        """Of an rcl_interfaces/msg/Parameter."""
        kind = cls.Type(param_msg.value.type)
        return cls(param_msg.name, kind, parameter_value_to_python(param_msg.value))

    @property
    def name(self) -> str:
        """The name."""
        return self._name

    @property
    def type_(self) -> Parameter.Type:
        """The type."""
        return self._type_

    @property
    def value(self) -> Any:
        """The value; a list where the type is an array."""
        return self._value

    def get_parameter_value(self) -> Any:
        """As an rcl_interfaces/msg/ParameterValue."""
        message: Any = message_class("rcl_interfaces/msg/ParameterValue")()
        message.type = self._type_.value
        field = _VALUE_FIELDS.get(self._type_.value)
        if field is not None:
            value = self._value
            setattr(message, field, list(value) if self._type_.value >= 5 else value)
        return message

    def to_parameter_msg(self) -> Any:
        """As an rcl_interfaces/msg/Parameter."""
        cls: Any = message_class("rcl_interfaces/msg/Parameter")
        return cls(name=self._name, value=self.get_parameter_value())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Parameter):
            return NotImplemented
        return (self._name, self._type_, self._value) == (other._name, other._type_, other._value)

    __hash__ = None  # type: ignore[assignment]  # its value may be a list

    def __repr__(self) -> str:
        return f"Parameter(name={self._name!r}, type_={self._type_}, value={self._value!r})"


def parameter_value_to_python(parameter_value: Any) -> Any:
    """The Python value of an rcl_interfaces/msg/ParameterValue; None where it is not set."""
    field = _VALUE_FIELDS.get(parameter_value.type)
    if field is None:
        if parameter_value.type == 0:
            return None
        raise ValueError(f"unexpected parameter type {parameter_value.type}")
    value = getattr(parameter_value, field)
    return list(value) if parameter_value.type >= 5 else value


def get_parameter_value(string_value: str) -> Any:
    """The rcl_interfaces/msg/ParameterValue of a text, read as YAML."""
    arguments = parse_arguments(["--ros-args", "-p", f"value:={string_value}"])
    value = arguments.parameters[0][0].value
    try:
        return Parameter("value", value=value).get_parameter_value()
    except TypeError:
        return Parameter("value", value=string_value).get_parameter_value()


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: Sequence[str] | None = None,
    namespace: str = "",
) -> dict[str, Any]:
    """The parameters in a YAML file, as rcl_interfaces/msg/Parameter messages by name.

    Args:
        parameter_file: The file.
        use_wildcard: Whether entries for ``/**`` count.
        target_nodes: Full names of the nodes whose entries count; all by default.
        namespace: Ignored but for rclpy's signature.
    """
    path = str(Path(parameter_file))
    rules: Iterable[Any] = parse_arguments(["--ros-args", "--params-file", path]).parameters[0]
    return {
        rule.name: Parameter(rule.name, value=rule.value).to_parameter_msg()
        for rule in rules
        if (use_wildcard if rule.is_wildcard and rule.node == "/**" else True)
        and (target_nodes is None or any(rule.matches(node) for node in target_nodes))
    }


def _is_exactly(value: Any, kind: type) -> bool:
    """A bool is no int here."""
    return isinstance(value, kind) and not (kind is int and isinstance(value, bool))
