# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Service clients."""

from __future__ import annotations

import random
import threading
import time
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from embedded_ros.transport.endpoints import Reader, Writer
from embedded_ros.types import Service as ServiceType
from embedded_ros.types.cdr import HEADER, deserialize, serialize

from ._entity import Endpoints, Entity, Work
from .qos import QoSProfile
from .service import PREFIX_SIZE, REQUEST_HEADER
from .task import Future

if TYPE_CHECKING:
    from .callback_groups import CallbackGroup
    from .node import Node

SrvT = TypeVar("SrvT")

READY_POLL_S = 0.01


class Client(Entity, Generic[SrvT]):
    """Asks a service."""

    def __init__(
        self,
        node: Node,
        ends: tuple[Reader, Writer],
        srv_type: type[ServiceType],
        srv_name: str,
        callback_group: CallbackGroup,
        qos: QoSProfile,
    ) -> None:
        super().__init__(callback_group)
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.qos_profile = qos
        self.context = node.context
        self._logger_name = node.get_logger().name
        self._reader, self._writer = ends
        self._endpoints = Endpoints(node, *ends)
        self._guid = random.SystemRandom().getrandbits(64)
        self._lock = threading.Lock()
        self._sequence = 0
        self._pending: dict[int, Future[Any]] = {}

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
        """The DDS reader of responses."""
        return self._reader

    def call_async(self, request: Any) -> Future[Any]:
        """Send a request.

        Returns:
            A future of the response.

        Raises:
            TypeError: The request is not of the service's request type.
            MessageFieldError: A field holds a value its type does not allow; says which.
        """
        if type(request) is not self.srv_type.Request:
            raise TypeError(
                f"{self.srv_name}: expected {self.srv_type.Request.ros_type}, "
                f"got {type(request).__name__}"
            )
        future: Future[Any] = Future()
        with self._lock:
            self._sequence += 1
            sequence = self._sequence
            prefix = HEADER + REQUEST_HEADER.pack(self._guid, sequence)
            data = serialize(request, prefix)
            self._pending[sequence] = future
        future.add_wakeup(self.remove_pending_request)  # where it is cancelled, say
        try:
            self._writer.write(data)
        except Exception:
            self.remove_pending_request(future)
            raise
        return future

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Send a request and wait for the response.

        Never call it from a callback on the executor that serves this client: it would wait
        for itself.

        Args:
            request: The request.
            timeout_sec: How long to wait, for ever by default.

        Returns:
            The response.

        Raises:
            TypeError: The request is not of the service's request type.
            TimeoutError: There was no response in time.
        """
        future = self.call_async(request)
        if not future.wait(timeout_sec):
            self.remove_pending_request(future)
            raise TimeoutError(f"{self.srv_name}: no response within {timeout_sec} s")
        return future.result()

    def remove_pending_request(self, future: Future[Any]) -> None:
        """Wait for this response no more."""
        with self._lock:
            self._pending = {s: f for s, f in self._pending.items() if f is not future}

    def service_is_ready(self) -> bool:
        """Whether some process both reads our requests and writes responses to us."""
        servers = {_participant(self._writer.matched(h)) for h in self._writer.matched_handles()}
        servers.discard(None)
        if not servers:
            return False
        repliers = {_participant(self._reader.matched(h)) for h in self._reader.matched_handles()}
        return bool(servers & repliers)

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until the service is ready.

        Args:
            timeout_sec: How long to wait, for ever by default.

        Returns:
            Whether it is ready.
        """
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while self.context.ok():
            if self.service_is_ready():
                return True
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(READY_POLL_S)
        return False

    def take(self) -> Work | None:
        """Finishing the future of the next response, where there is one."""
        while (sample := self._reader.take()) is not None:
            guid, sequence = REQUEST_HEADER.unpack_from(sample.data, len(HEADER))
            if guid != self._guid:
                continue  # another client's: DDS delivers every response to every client
            with self._lock:
                future = self._pending.pop(sequence, None)
            if future is not None:
                return Work(self._finish, (future, sample.data))
        return None

    def configure_introspection(self, *args: object) -> None:
        """Not provided."""
        raise NotImplementedError("service introspection is not part of embedded_ros")

    def destroy(self) -> None:
        """Delete it; prefer :meth:`Node.destroy_client`."""
        self.leave_node()
        self._endpoints.close()

    def __enter__(self) -> Client[SrvT]:
        return self

    def __exit__(self, *exc: Any) -> None:
        self.destroy()

    def _finish(self, future: Future[Any], data: bytes) -> None:
        response = deserialize(data, self.srv_type.Response.ros_type, PREFIX_SIZE)
        node = self.node
        executor = node.executor if node is not None else None
        if executor is not None:
            future._set_executor(executor)
        if not future.cancelled():
            future.set_result(response)


def _participant(endpoint: Any) -> bytes | None:
    return endpoint.participant_key.bytes if endpoint is not None else None
