# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's ROS parameters, declared and read once into a frozen dataclass."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

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
