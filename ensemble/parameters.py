# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's ROS parameters, declared and read once into a frozen dataclass."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Collection, Mapping
from dataclasses import field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from slap_ros.errors import InvalidParameterError

P = TypeVar("P")
MAX_NUMBER = 1e9  # of what has no other limit: seconds and steps as ROS messages have room for
MAX_SEED = 2**63 - 1
OF_ROS = ("use_sim_time", "start_type_description_service")  # parameters that ROS declares itself
OF_TOPICS = "qos_overrides."  # declared with the topics that they are about
# What says which task all nodes are about, and how long they wait. A block `/**` of a parameter
# file may set it for all of them: a node that has no such parameter passes it over.
OF_ENSEMBLE = ("domain", "preset", "skills", "libraries", "patience", "seed", "index", "goal")
OF_ALL_NODES = (*OF_ROS, *OF_ENSEMBLE)


def parameter(default: Any, description: str, low: float = 0.0, high: float = MAX_NUMBER) -> Any:
    """A field of a parameters dataclass: its default gives the type, which ROS then enforces.

    Args:
        default: What it is where nothing else is said.
        description: What it means, with its unit.
        low: Lowest value that is allowed, for a number.
        high: Highest value that is allowed, for a number.

    Returns:
        The field, for :func:`read_parameters`.
    """
    return field(default=default, metadata={"description": description, "low": low, "high": high})


def with_default(kind: type, name: str, default: Any) -> Any:
    """A field of a parameters dataclass with another default.

    Args:
        kind: Dataclass that has the field.
        name: Name of the field.
        default: What it is where nothing else is said.
    """
    (item,) = (item for item in fields(kind) if item.name == name)
    return field(default=default, metadata=item.metadata)


def read_parameters(node: Node, kind: type[P]) -> P:
    """Declare all parameters of a node, and read them.

    Args:
        node: Node that has just been made.
        kind: Dataclass of its parameters.

    Raises:
        rclpy.exceptions.InvalidParameterTypeException: A value was given with another type.
        InvalidParameterError: A number is not finite or beyond its limits, or a value was given
            for a parameter that the node does not have.
    """
    settings = declare_parameters(node, kind)
    require_declared(node)
    return settings


def declare_parameters(node: Node, kind: type[P]) -> P:
    """Declare every field of ``kind`` as a read-only parameter and read it.

    Raises:
        rclpy.exceptions.InvalidParameterTypeException: A value was given with another type.
        InvalidParameterError: A number is not finite or beyond its limits.
    """
    values = {}
    for item in fields(kind):  # type: ignore[arg-type]
        descriptor = ParameterDescriptor(description=item.metadata["description"], read_only=True)
        value = node.declare_parameter(item.name, item.default, descriptor).value
        _require_within(f"parameter {item.name} of {node.get_name()}", value, item.metadata)
        values[item.name] = value
    return kind(**values)


def require_declared(node: Node) -> None:
    """Refuse values for parameters that a node does not have, which rclpy passes over silently.

    Args:
        node: Node that has declared all its parameters.

    Raises:
        InvalidParameterError: There is such a value.
    """
    given = node._parameter_overrides  # rclpy has no public name for them
    own = [name for name in given if not (name in OF_ALL_NODES or name.startswith(OF_TOPICS))]
    if unknown := [name for name in own if not node.has_parameter(name)]:
        names = ", ".join(sorted(set(node.list_parameters([], 0).names) - set(OF_ROS)))
        raise InvalidParameterError(
            f"unknown parameter {', '.join(map(repr, unknown))}; {node.get_name()} has {names}"
        )


# What turns a text into a value, by the type of the default, where that is not the type itself.
_VALUES: Mapping[type, Callable[[str], Any]] = {
    bool: {"true": True, "false": False}.__getitem__,
    tuple: lambda text: tuple(map(float, text.split())),
}
_WANTED = {bool: "true or false", int: "a whole number"}


def parse_parameters(
    text: str, kind: type[P], what: str, given: Collection[str] = ()
) -> dict[str, Any]:
    """Parameters as a command line has them, ``latency=0.05,dropout=0.1``, of their own types.

    Several numbers are separated by blanks.

    Args:
        text: The parameters.
        kind: The dataclass that they are of.
        what: Name of what the parameters belong to, for messages.
        given: Names of those that come from elsewhere, and are refused here.

    Returns:
        Parameters by name, of the types that the dataclass has.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    known_fields = {item.name: item for item in fields(kind)}  # type: ignore[arg-type]
    kinds = {name: type(item.default) for name, item in known_fields.items()}
    known = [name for name in kinds if name not in given]
    found: dict[str, Any] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if name not in known:
            raise InvalidParameterError(
                f"the {what} has no parameter {name!r}; it has {', '.join(known)}"
            )
        try:
            found[name] = _VALUES.get(kinds[name], kinds[name])(value)
        except (ValueError, KeyError):
            wanted = _WANTED.get(kinds[name], "a number")
            raise InvalidParameterError(
                f"the {what}'s {name} must be {wanted}, not {value!r}"
            ) from None
        _require_within(f"the {what}'s {name}", found[name], known_fields[name].metadata)
    return found


def _require_within(what: str, value: Any, limits: Mapping[str, Any]) -> None:
    """Refuse numbers that are not finite or beyond their limits; what is no number passes."""
    low, high = limits["low"], limits["high"]
    numbers = value if isinstance(value, list | tuple | array) else (value,)
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, int | float):
            continue
        if not (math.isfinite(number) and low <= number <= high):
            raise InvalidParameterError(f"{what} is {number}; it must be from {low:g} to {high:g}")
