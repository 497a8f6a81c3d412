# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node's topics need of their types, built before there is a node.

CycloneDDS describes a type to other participants, and works that description out in Python when a
process has its first topic of the type: half of what a node takes to start. Who forks processes of
nodes does it once for all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from embedded_ros.transport import descriptors, discovery
from embedded_ros.types import service_class
from embedded_ros.types.interfaces import Action, Message, Service

# Those that every node has.
PARAMETER_SERVICES = {  # types, of rcl_interfaces, by name
    "describe_parameters": "DescribeParameters",
    "get_parameters": "GetParameters",
    "get_parameter_types": "GetParameterTypes",
    "list_parameters": "ListParameters",
    "set_parameters": "SetParameters",
    "set_parameters_atomically": "SetParametersAtomically",
}
MESSAGES = (discovery.TYPE, "rcl_interfaces/msg/Log", "rcl_interfaces/msg/ParameterEvent")


def prepare(interfaces: Iterable[type]) -> None:
    """Build what topics need of some interfaces, and of those that every node has.

    Args:
        interfaces: Classes of messages, services and actions.
    """
    for descriptor in _descriptors(interfaces):
        descriptor.__idl__.fill_type_data()


def _descriptors(interfaces: Iterable[type]) -> Iterator[Any]:
    yield from map(descriptors.message_descriptor, MESSAGES)
    for name in PARAMETER_SERVICES.values():
        yield from _of_service(service_class(f"rcl_interfaces/srv/{name}"))
    for interface in interfaces:
        if issubclass(interface, Action):
            parts = interface.Impl
            for service in (parts.SendGoalService, parts.GetResultService, parts.CancelGoalService):
                yield from _of_service(service)
            for message in (parts.FeedbackMessage, parts.GoalStatusMessage):
                yield descriptors.message_descriptor(message.ros_type)
        elif issubclass(interface, Service):
            yield from _of_service(interface)
        elif issubclass(interface, Message):
            yield descriptors.message_descriptor(interface.ros_type)


def _of_service(service: type[Service]) -> Iterator[Any]:
    for part in ("Request", "Response"):
        yield descriptors.service_message_descriptor(f"{service.ros_type}_{part}")
