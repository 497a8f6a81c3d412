# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message, service and action classes, built from their definitions when first used."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, ClassVar, TypeVar

from .catalogue import catalogue
from .errors import InterfaceError
from .fields import ArrayProperty, SequenceProperty, default_of, is_numeric_collection
from .hashing import action_hash, message_hash, service_hash
from .model import FieldType, MessageSpec, Shape

_IDL_NAMES = {
    "bool": "boolean",
    "byte": "octet",
    "char": "uint8",
    "float32": "float",
    "float64": "double",
}


class Message:
    """Base of every message class.

    A message has one attribute a field. Numeric sequences are ``array.array``, numeric fixed
    arrays ``numpy.ndarray``, all others ``list``; anything that converts may be assigned to
    them. A ``byte`` is a ``bytes`` of length 1. All other fields are plain attributes, checked
    when the message is serialized.
    """

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]  # mutable

    ros_type: ClassVar[str]
    spec: ClassVar[MessageSpec]

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """The fields' IDL types, by field name."""
        return {field.name: idl_name(field.type) for field in cls.spec.fields}

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            _equal(getattr(self, field.name), getattr(other, field.name))
            for field in self.spec.fields
        )

    def __repr__(self) -> str:
        package, kind, name = self.ros_type.split("/")
        values = ", ".join(f"{f.name}={_readable(getattr(self, f.name))}" for f in self.spec.fields)
        return f"{package}.{kind}.{name}({values})"


class Service:
    """Base of every service class: a namespace, never instantiated."""

    ros_type: ClassVar[str]
    Request: ClassVar[type[Message]]
    Response: ClassVar[type[Message]]

    def __init__(self) -> None:
        raise NotImplementedError(f"{self.ros_type} is a service type: use its Request or Response")


class Action:
    """Base of every action class: a namespace, never instantiated."""

    ros_type: ClassVar[str]
    Goal: ClassVar[type[Message]]
    Result: ClassVar[type[Message]]
    Feedback: ClassVar[type[Message]]
    Impl: ClassVar[type[ActionImpl]]

    def __init__(self) -> None:
        raise NotImplementedError(
            f"{self.ros_type} is an action type: use its Goal, Result or Feedback"
        )


class ActionImpl:
    """The services and messages that carry an action."""

    SendGoalService: ClassVar[type[Service]]
    GetResultService: ClassVar[type[Service]]
    CancelGoalService: ClassVar[type[Service]]
    FeedbackMessage: ClassVar[type[Message]]
    GoalStatusMessage: ClassVar[type[Message]]


def idl_name(field_type: FieldType) -> str:
    """A field's type as rclpy names it: ``sequence<double>``."""
    if field_type.primitive is None:
        package, _, name = field_type.base.split("/")
        element = f"{package}/{name}"
    else:
        element = _IDL_NAMES.get(field_type.base, field_type.base)
    if field_type.string_bound:
        element += f"<{field_type.string_bound}>"
    if field_type.shape is Shape.ARRAY:
        return f"{element}[{field_type.size}]"
    if field_type.shape is Shape.SEQUENCE:
        return (
            f"sequence<{element}, {field_type.size}>" if field_type.size else f"sequence<{element}>"
        )
    return element


def message_class(full_name: str) -> type[Message]:
    """The class of a message.

    Raises:
        InterfaceError: The message, or one nested in it, is unknown or malformed.
    """
    return _message_classes.get(full_name) or _once(_message_classes, full_name, _build_message)


def service_class(full_name: str) -> type[Service]:
    """The class of a service; raises InterfaceError as :func:`message_class`."""
    return _service_classes.get(full_name) or _once(_service_classes, full_name, _build_service)


def action_class(full_name: str) -> type[Action]:
    """The class of an action; raises InterfaceError as :func:`message_class`."""
    return _action_classes.get(full_name) or _once(_action_classes, full_name, _build_action)


# One class a name: two threads that both built "the" class could not exchange messages.
_building = threading.RLock()
_message_classes: dict[str, type[Message]] = {}
_service_classes: dict[str, type[Service]] = {}
_action_classes: dict[str, type[Action]] = {}

ClassT = TypeVar("ClassT")


def _once(built: dict[str, ClassT], full_name: str, build: Callable[[str], ClassT]) -> ClassT:
    with _building:
        if full_name not in built:
            built[full_name] = build(full_name)
        return built[full_name]


def _build_message(full_name: str) -> type[Message]:
    spec = catalogue().message(full_name)
    package, kind, name = full_name.split("/")
    namespace: dict[str, Any] = {
        "__doc__": f"Message {full_name}.",
        "__module__": f"{package}.{kind}",
        "__qualname__": name,
        "ros_type": full_name,
        "spec": spec,
        "__init__": _constructor(spec),
    }
    slots = []
    for field in spec.fields:
        if is_numeric_collection(field.type):
            slots.append(f"_{field.name}")
            property_type = ArrayProperty if field.type.shape is Shape.ARRAY else SequenceProperty
            namespace[field.name] = property_type(full_name, field)
        else:
            slots.append(field.name)
    namespace["__slots__"] = tuple(slots)
    namespace.update({constant.name: constant.value for constant in spec.constants})
    return type(name, (Message,), namespace)


def _build_service(full_name: str) -> type[Service]:
    catalogue().service(full_name)  # an unknown service fails here, with its own name
    package, kind, name = full_name.split("/")
    return type(
        name,
        (Service,),
        {
            "__doc__": f"Service {full_name}.",
            "__module__": f"{package}.{kind}",
            "ros_type": full_name,
            "Request": message_class(f"{full_name}_Request"),
            "Response": message_class(f"{full_name}_Response"),
        },
    )


def _build_action(full_name: str) -> type[Action]:
    catalogue().action(full_name)  # an unknown action fails here, with its own name
    package, kind, name = full_name.split("/")
    implementation = type(
        "Impl",
        (ActionImpl,),
        {
            "SendGoalService": service_class(f"{full_name}_SendGoal"),
            "GetResultService": service_class(f"{full_name}_GetResult"),
            "CancelGoalService": service_class("action_msgs/srv/CancelGoal"),
            "FeedbackMessage": message_class(f"{full_name}_FeedbackMessage"),
            "GoalStatusMessage": message_class("action_msgs/msg/GoalStatusArray"),
        },
    )
    return type(
        name,
        (Action,),
        {
            "__doc__": f"Action {full_name}.",
            "__module__": f"{package}.{kind}",
            "ros_type": full_name,
            "Goal": message_class(f"{full_name}_Goal"),
            "Result": message_class(f"{full_name}_Result"),
            "Feedback": message_class(f"{full_name}_Feedback"),
            "Impl": implementation,
        },
    )


@functools.cache
def message_type_hash(full_name: str) -> str:
    """The RIHS01 hash of a message."""
    return message_hash(catalogue().message(full_name), catalogue().message)


@functools.cache
def service_type_hash(full_name: str) -> str:
    """The RIHS01 hash of a service."""
    catalogue().service(full_name)
    return service_hash(full_name, catalogue().message)


@functools.cache
def action_type_hash(full_name: str) -> str:
    """The RIHS01 hash of an action."""
    catalogue().action(full_name)
    return action_hash(full_name, catalogue().message)


class _Unset:
    """Marks an argument that was not given, where None could be a (wrong) value."""

    def __repr__(self) -> str:
        return "<default>"


_UNSET = _Unset()


def _constructor(spec: MessageSpec) -> Any:
    """A constructor taking every field as a keyword, generated for speed."""
    names: dict[str, Any] = {"_UNSET": _UNSET}
    arguments, body = [], []
    for index, field in enumerate(spec.fields):
        factory = default_of(field, _nested_class)
        names[f"_default_{index}"] = factory
        if field.type.shape is Shape.SINGLE and field.type.primitive is not None:
            names[f"_value_{index}"] = factory()
            arguments.append(f"{field.name}=_value_{index}")
            body.append(f"    self.{field.name} = {field.name}")
        else:
            arguments.append(f"{field.name}=_UNSET")
            target = f"_{field.name}" if is_numeric_collection(field.type) else field.name
            body += [
                f"    if {field.name} is _UNSET:",
                f"        self.{target} = _default_{index}()",
                "    else:",
                f"        self.{field.name} = {field.name}",
            ]
    star = ", *, " if arguments else ""
    source = f"def __init__(self{star}{', '.join(arguments)}):\n" + "\n".join(body or ["    pass"])
    if any(field.name in ("self", "_UNSET") for field in spec.fields):
        raise InterfaceError(f"{spec.full_name}: a field cannot be called 'self'")
    exec(compile(source, f"<constructor of {spec.full_name}>", "exec"), names)
    return names["__init__"]


def _nested_class(full_name: str) -> type[Message]:
    return message_class(full_name)


def _equal(left: object, right: object) -> bool:
    if hasattr(left, "dtype") or hasattr(right, "dtype"):
        import numpy as np

        return np.array_equal(left, right)  # type: ignore[arg-type]
    return bool(left == right)


def _readable(value: object) -> str:
    """Arrays as plain lists: the element type is the field's anyway."""
    to_list = getattr(value, "tolist", None)
    return repr(to_list() if to_list else value)
