# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's ROS parameters, declared and read once into a frozen dataclass."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from slap_ros.errors import InvalidParameterError

P = TypeVar("P")


def parameter(default: Any, description: str) -> Any:
    """A field of a parameters dataclass: its default gives the type, which ROS then enforces."""
    return field(default=default, metadata={"description": description})


def read_parameters(node: Node, kind: type[P]) -> P:
    """Declare every field of ``kind`` as a read-only parameter and read it.

    Raises:
        rclpy.exceptions.InvalidParameterTypeException: A value was given with another type.
    """
    values = {}
    for item in fields(kind):  # type: ignore[arg-type]
        descriptor = ParameterDescriptor(description=item.metadata["description"], read_only=True)
        values[item.name] = node.declare_parameter(item.name, item.default, descriptor).value
    return kind(**values)


def parse_parameters(
    text: str, kind: type[P], what: str, given: Collection[str] = ()
) -> dict[str, Any]:
    """Parameters as a command line has them, ``latency=0.05,dropout=0.1``, of their own types.

    Several numbers are separated by blanks.

    Args:
        text: The parameters.
        kind: The dataclass that they are of.
        what: Whose they are, for messages.
        given: Names of those that come from elsewhere, and are refused here.

    Returns:
        Parameters by name, of the types that the dataclass has.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    kinds = {item.name: type(item.default) for item in fields(kind)}  # type: ignore[arg-type]
    known = [name for name in kinds if name not in given]
    found: dict[str, Any] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if name not in known:
            raise InvalidParameterError(
                f"the {what} has no parameter {name!r}; it has {', '.join(known)}"
            )
        try:
            found[name] = (
                tuple(map(float, value.split())) if kinds[name] is tuple else kinds[name](value)
            )
        except ValueError:
            raise InvalidParameterError(f"the {what}'s {name} is a number, not {value!r}") from None
    return found
