# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Services."""

from __future__ import annotations

import inspect
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from embedded_ros.transport import user_data
from embedded_ros.transport.endpoints import Reader, Sample, Writer
from embedded_ros.types import Service as ServiceType
from embedded_ros.types.cdr import HEADER_SIZE, deserialize, serialize

from ._entity import Endpoints, Entity, Work
from .qos import QoSProfile

if TYPE_CHECKING:
    from .callback_groups import CallbackGroup
    from .node import Node

SrvT = TypeVar("SrvT")

# Who asks, and which of its requests: rmw_cyclonedds's header of requests and responses.
REQUEST_HEADER = struct.Struct("=Qq")
PREFIX_SIZE = HEADER_SIZE + REQUEST_HEADER.size
# rmw_cyclonedds waits for a client that is not fully discovered for 0.1 s. That is less than one
# lost packet takes, and then the client would wait for its response for ever.
DISCOVERY_WAIT_S = 5.0
DISCOVERY_POLL_S = 0.002


@dataclass(frozen=True, slots=True)
class RequestHeader:
    """What a response must carry to reach whoever asked."""

    prefix: bytes  # CDR header and request header
    publication_handle: int


class Service(Entity, Generic[SrvT]):
    """Answers requests."""

    def __init__(
        self,
        node: Node,
        ends: tuple[Reader, Writer],
        srv_type: type[ServiceType],
        srv_name: str,
        callback: Callable[..., Any],
        callback_group: CallbackGroup,
        qos: QoSProfile,
    ) -> None:
        super().__init__(callback_group)
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.callback = callback
        self.qos_profile = qos
        self._logger_name = node.get_logger().name
        self._reader, self._writer = ends
        self._endpoints = Endpoints(node, *ends)
        self._known_clients: set[int] = set()

    @property
    def service_name(self) -> str:
        """The service's full name."""
        return self.srv_name

    @property
    def logger_name(self) -> str:
        """The name of the node's logger."""
        return self._logger_name

    @property
    def reader(self) -> Reader:
        """The DDS reader of requests."""
        return self._reader

    def take(self) -> Work | None:
        """The callback with the next request, where there is one."""
        sample = self._reader.take()
        return None if sample is None else Work(self._answer, (sample,))

    def send_response(self, response: Any, header: RequestHeader) -> None:
        """Send a response.

        Raises:
            TypeError: It is not of the service's response type.
            MessageFieldError: A field holds a value its type does not allow; says which.
        """
        if type(response) is not self.srv_type.Response:
            raise TypeError(
                f"{self.srv_name}: expected {self.srv_type.Response.ros_type}, "
                f"got {type(response).__name__}"
            )
        data = serialize(response, header.prefix)
        self._wait_for_client(header.publication_handle)
        self._writer.write(data)

    def configure_introspection(self, *args: object) -> None:
        """Not provided."""
        raise NotImplementedError("service introspection is not part of embedded_ros")

    def destroy(self) -> None:
        """Delete it; prefer :meth:`Node.destroy_service`."""
        self.leave_node()
        self._endpoints.close()

    def __enter__(self) -> Service[SrvT]:
        return self

    def __exit__(self, *exc: Any) -> None:
        self.destroy()

    async def _answer(self, sample: Sample) -> None:
        request = deserialize(sample.data, self.srv_type.Request.ros_type, PREFIX_SIZE)
        header = RequestHeader(sample.data[:PREFIX_SIZE], sample.publication_handle)
        response = self.callback(request, self.srv_type.Response())
        if inspect.isawaitable(response):
            response = await response
        self.send_response(response, header)

    def _wait_for_client(self, publication_handle: int) -> None:
        """Wait until the client's reader of responses is discovered: earlier ones get lost."""
        if publication_handle in self._known_clients:
            return
        deadline = time.monotonic() + DISCOVERY_WAIT_S
        while (client_id := self._client_id(publication_handle)) is not None:
            if self._reads_responses(client_id):
                self._known_clients.add(publication_handle)
                return
            if time.monotonic() > deadline:
                return
            time.sleep(DISCOVERY_POLL_S)

    def _client_id(self, publication_handle: int) -> str | None:
        """What ties a client's ends together; None for a client of no ROS, or that has gone."""
        requester = self._reader.matched(publication_handle)
        return user_data.value(requester, "clientid") if requester is not None else None

    def _reads_responses(self, client_id: str) -> bool:
        readers = (self._writer.matched(handle) for handle in self._writer.matched_handles())
        return any(
            reader is not None and user_data.value(reader, "clientid") == client_id
            for reader in readers
        )
