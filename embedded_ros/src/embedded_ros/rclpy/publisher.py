# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from embedded_ros.transport.endpoints import Writer
from embedded_ros.transport.errors import InvalidHandle
from embedded_ros.types import Message
from embedded_ros.types.cdr import serialize

from ._entity import Endpoints
from .duration import Duration, Infinite
from .qos import QoSProfile

if TYPE_CHECKING:
    from .node import Node

MsgT = TypeVar("MsgT")


class Publisher(Generic[MsgT]):
    """Publishes messages on a topic."""

    def __init__(
        self, node: Node, writer: Writer, msg_type: type[Message], topic: str, qos: QoSProfile
    ) -> None:
        self.msg_type = msg_type
        self.topic = topic
        self.qos_profile = qos
        self._context = node.context
        self._logger = node.get_logger()
        self._writer = writer
        self._endpoints = Endpoints(node, writer)

    @property
    def topic_name(self) -> str:
        """The topic's full name."""
        return self.topic

    @property
    def logger_name(self) -> str:
        """The name of the node's logger."""
        return self._logger.name

    @property
    def writer(self) -> Writer:
        """The DDS writer."""
        return self._writer

    def publish(self, msg: MsgT | bytes) -> None:
        """Publish a message, or the bytes of a serialized one.

        Raises:
            TypeError: The message is not of the publisher's type.
            MessageFieldError: A field holds a value its type does not allow; says which.
            RCLError: It could not be written: shut down, or blocked for too long.
        """
        if isinstance(msg, bytes | bytearray | memoryview):
            data = bytes(msg)
            data += bytes(-len(data) % 4)
        elif type(msg) is self.msg_type:
            data = serialize(msg)  # type: ignore[arg-type]
        else:
            raise TypeError(
                f"{self.topic}: expected {self.msg_type.ros_type}, got {type(msg).__name__}"
            )
        if not self._context.ok():
            raise InvalidHandle(f"{self.topic}: publisher's context is invalid")
        self._writer.write(data)

    def get_subscription_count(self) -> int:
        """How many subscriptions are matched."""
        return len(self._writer.matched_handles())

    def assert_liveliness(self) -> None:
        """Nothing to do: liveliness is automatic."""

    def wait_for_all_acked(self, timeout: Duration = Infinite) -> bool:
        """Wait until every reliable subscription has everything, or the time is up."""
        return self._writer.wait_for_acknowledgements(timeout.nanoseconds)

    def destroy(self) -> None:
        """Delete it; prefer :meth:`Node.destroy_publisher`."""
        self._endpoints.close()

    def __enter__(self) -> Publisher[MsgT]:
        return self

    def __exit__(self, *exc: Any) -> None:
        self.destroy()
