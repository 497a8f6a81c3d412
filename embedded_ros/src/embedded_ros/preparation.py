# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node's topics need of their types, built before there is a node.

It is a third of what a node takes to start. Who forks processes of nodes does it once for all.
"""

from __future__ import annotations

from collections.abc import Iterable

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
    for full_name in MESSAGES:
        descriptors.topic_descriptor(full_name, service=False)
    for name in PARAMETER_SERVICES.values():
        _prepare_service(service_class(f"rcl_interfaces/srv/{name}"))
    for interface in interfaces:
        if issubclass(interface, Action):
            parts = interface.Impl
            for service in (parts.SendGoalService, parts.GetResultService, parts.CancelGoalService):
                _prepare_service(service)
            for message in (parts.FeedbackMessage, parts.GoalStatusMessage):
                descriptors.topic_descriptor(message.ros_type, service=False)
        elif issubclass(interface, Service):
            _prepare_service(interface)
        elif issubclass(interface, Message):
            descriptors.topic_descriptor(interface.ros_type, service=False)


def _prepare_service(service: type[Service]) -> None:
    for part in ("Request", "Response"):
        descriptors.topic_descriptor(f"{service.ros_type}_{part}", service=True)
