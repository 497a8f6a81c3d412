# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from embedded_ros.transport.endpoints import Reader
from embedded_ros.types import Message
from embedded_ros.types.cdr import deserialize

from ._entity import Endpoints, Entity, Work
from .qos import QoSProfile

if TYPE_CHECKING:
    from .callback_groups import CallbackGroup
    from .node import Node

MsgT = TypeVar("MsgT")


class Subscription(Entity, Generic[MsgT]):
    """Calls back with every message on a topic."""

    def __init__(
        self,
        node: Node,
        reader: Reader,
        msg_type: type[Message],
        topic: str,
        callback: Callable[..., Any],
        callback_group: CallbackGroup,
        qos: QoSProfile,
        raw: bool,
    ) -> None:
        if not callable(callback):
            raise TypeError(f"{topic}: the callback {callback!r} is not callable")
        _refuse_message_info(callback, topic)
        super().__init__(callback_group)
        self.msg_type = msg_type
        self.topic = topic
        self.qos_profile = qos
        self.raw = raw
        self.callback = callback
        self._logger_name = node.get_logger().name
        self._reader = reader
        self._endpoints = Endpoints(node, reader)

    @property
    def topic_name(self) -> str:
        """The topic's full name."""
        return self.topic

    @property
    def logger_name(self) -> str:
        """The name of the node's logger."""
        return self._logger_name

    @property
    def reader(self) -> Reader:
        """The DDS reader."""
        return self._reader

    def get_publisher_count(self) -> int:
        """How many publishers are matched."""
        return len(self._reader.matched_handles())

    def take(self) -> Work | None:
        """The callback with the next message, where there is one."""
        sample = self._reader.take()
        if sample is None:
            return None
        if self.raw:
            return Work(self.callback, (sample.data,))
        return Work(self._deliver, (sample.data,))

    def destroy(self) -> None:
        """Delete it; prefer :meth:`Node.destroy_subscription`."""
        self.leave_node()
        self._endpoints.close()

    def __enter__(self) -> Subscription[MsgT]:
        return self

    def __exit__(self, *exc: Any) -> None:
        self.destroy()

    def _deliver(self, data: bytes) -> Any:
        return self.callback(deserialize(data, self.msg_type.ros_type))


def _refuse_message_info(callback: Callable[..., Any], topic: str) -> None:
    """A callback with a second argument would get a MessageInfo from rclpy, but not here."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        raise NotImplementedError(
            f"{topic}: the callback must take the message as its only argument; "
            "MessageInfo is not part of embedded_ros"
        ) from None
    except ValueError:
        return  # a builtin without a signature
