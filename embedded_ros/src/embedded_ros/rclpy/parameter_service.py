# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services behind ``ros2 param``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from embedded_ros.preparation import PARAMETER_SERVICES
from embedded_ros.types import message_class, service_class

from .callback_groups import CallbackGroup
from .exceptions import ParameterException
from .parameter import Parameter
from .qos import qos_profile_parameters

if TYPE_CHECKING:
    from .node import Node
    from .service import Service


class ParameterService:
    """Serves a node's parameters."""

    def __init__(self, node: Node) -> None:
        self._node = node
        group: CallbackGroup = node.default_callback_group
        handlers = {
            "describe_parameters": self._describe,
            "get_parameters": self._get,
            "get_parameter_types": self._get_types,
            "list_parameters": self._list,
            "set_parameters": self._set,
            "set_parameters_atomically": self._set_atomically,
        }
        self.services: list[Service[Any]] = [
            node.create_service(
                service_class(f"rcl_interfaces/srv/{PARAMETER_SERVICES[name]}"),
                f"~/{name}",
                handler,
                qos_profile=qos_profile_parameters,
                callback_group=group,
            )
            for name, handler in handlers.items()
        ]

    def _describe(self, request: Any, response: Any) -> Any:
        response.descriptors = [
            self._node.describe_parameter(name)
            for name in request.names
            if self._node.has_parameter(name)
        ]
        return response

    def _get(self, request: Any, response: Any) -> Any:
        empty: Any = message_class("rcl_interfaces/msg/ParameterValue")
        for name in request.names:
            parameter = self._node.peek_parameter(name)
            response.values.append(parameter.get_parameter_value() if parameter else empty())
        return response

    def _get_types(self, request: Any, response: Any) -> Any:
        parameters = [self._node.peek_parameter(name) for name in request.names]
        response.types = [p.type_.value if p else Parameter.Type.NOT_SET.value for p in parameters]
        return response

    def _list(self, request: Any, response: Any) -> Any:
        response.result = self._node.list_parameters(request.prefixes, request.depth)
        return response

    def _set(self, request: Any, response: Any) -> Any:
        response.results = [self._set_all([message]) for message in request.parameters]
        return response

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._set_all(request.parameters)
        return response

    def _set_all(self, messages: list[Any]) -> Any:
        try:
            return self._node.set_parameters_atomically(
                [Parameter.from_parameter_msg(message) for message in messages]
            )
        except (ParameterException, ValueError) as error:
            cls: Any = message_class("rcl_interfaces/msg/SetParametersResult")
            return cls(successful=False, reason=str(error))
