# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The DDS participant behind a context."""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from typing import Any

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from ..types import message_type_hash
from . import config, descriptors, names
from .discovery import DiscoveryInfo
from .endpoints import Reader, WaitSet, Writer
from .errors import InvalidHandle, RCLError
from .graph import Graph
from .loopback import loopback_only


class _Domains:
    """The configured domains of this process, shared by its participants."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: dict[int, tuple[Domain | None, int]] = {}

    def acquire(self, domain_id: int) -> None:
        with self._lock:
            domain, users = self._open.get(domain_id, (None, 0))
            if users == 0:
                domain = _configured(domain_id)
            self._open[domain_id] = (domain, users + 1)

    def release(self, domain_id: int) -> None:
        with self._lock:
            domain, users = self._open.pop(domain_id)
            if users > 1:
                self._open[domain_id] = (domain, users - 1)
            elif domain is not None:
                domain.__del__()


def _configured(domain_id: int) -> Domain | None:
    """The domain as the environment wants it; None where that is CycloneDDS's own business."""
    xml = config.configuration()
    if xml is None:
        return None
    with loopback_only() if config.is_host_only() else nullcontext():
        return Domain(domain_id, xml)


_domains = _Domains()


def _joined(domain_id: int) -> DomainParticipant:
    """A participant in a domain.

    Raises:
        RCLError: CycloneDDS refuses its configuration, or finds no network.
    """
    try:
        _domains.acquire(domain_id)
        try:
            # SROS 2's enclave, which `ros2 node info` and rmw's graph cache look for.
            return DomainParticipant(domain_id, Qos(Policy.Userdata(b"enclave=/;")))
        except BaseException:
            _domains.release(domain_id)
            raise
    except DDSException as error:
        raise RCLError(
            f"CycloneDDS cannot join domain {domain_id}: its own message above says why; check "
            "CYCLONEDDS_URI, ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS"
        ) from error


class Participant:
    """One per context: creates endpoints and announces which node each belongs to."""

    def __init__(self, domain_id: int) -> None:
        self.domain_id = config.checked_domain_id(domain_id)
        self._entity = _joined(domain_id)
        self.gid: bytes = self._entity.guid.bytes
        self._lock = threading.RLock()
        self._topics: dict[tuple[str, str], Topic[Any]] = {}
        self._endpoints: set[Reader | Writer] = set()
        self._wait_sets: set[WaitSet] = set()
        self._service_ends = 0
        self.closed = False
        self.discovery = DiscoveryInfo(self)
        # From the start: asked for the first time, it must know what was announced before.
        self.graph = Graph(self, self._entity)

    def create_writer(
        self, topic: str, full_name: str, policies: Iterable[Any], service_id: bytes = b""
    ) -> Writer:
        """Create a writer.

        Args:
            topic: The DDS topic's name.
            full_name: The ROS type.
            policies: QoS of the endpoint.
            service_id: For a service's end: what ties it to its other end.
        """
        with self._lock:
            entity = DataWriter(
                self._open_entity(),
                self._topic(topic, full_name, service=bool(service_id)),
                _qos(full_name, policies, service_id),
            )
            writer = Writer(entity, topic)
            self._endpoints.add(writer)
            return writer

    def create_reader(
        self, topic: str, full_name: str, policies: Iterable[Any], service_id: bytes = b""
    ) -> Reader:
        """Create a reader; arguments as for :meth:`create_writer`."""
        with self._lock:
            entity = DataReader(
                self._open_entity(),
                self._topic(topic, full_name, service=bool(service_id)),
                _qos(full_name, policies, service_id),
            )
            reader = Reader(entity, topic)
            self._endpoints.add(reader)
            return reader

    def create_client_ends(
        self, service: str, full_name: str, policies: Sequence[Any]
    ) -> tuple[Reader, Writer]:
        """A service client's reader of responses and writer of requests."""
        tag = self._service_tag("clientid")
        # The reader first: a server that knows our writer then knows our reader as well.
        reader = self.create_reader(
            names.reply_topic(service), f"{full_name}_Response", policies, tag
        )
        writer = self.create_writer(
            names.request_topic(service), f"{full_name}_Request", policies, tag
        )
        return reader, writer

    def create_server_ends(
        self, service: str, full_name: str, policies: Sequence[Any]
    ) -> tuple[Reader, Writer]:
        """A service server's reader of requests and writer of responses."""
        tag = self._service_tag("serviceid")
        writer = self.create_writer(
            names.reply_topic(service), f"{full_name}_Response", policies, tag
        )
        reader = self.create_reader(
            names.request_topic(service), f"{full_name}_Request", policies, tag
        )
        return reader, writer

    def create_wait_set(self) -> WaitSet:
        """Create a wait set."""
        with self._lock:
            wait_set = WaitSet(self._open_entity()._ref)
            self._wait_sets.add(wait_set)
            return wait_set

    def close_endpoint(self, endpoint: Reader | Writer) -> None:
        """Delete an endpoint; closing twice is allowed."""
        with self._lock:
            self._endpoints.discard(endpoint)
            endpoint.close()

    def close_wait_set(self, wait_set: WaitSet) -> None:
        """Delete a wait set; closing twice is allowed."""
        with self._lock:
            self._wait_sets.discard(wait_set)
            wait_set.close()

    def wake_all(self) -> None:
        """End every wait on this participant's wait sets."""
        with self._lock:
            for wait_set in self._wait_sets:
                wait_set.wake()

    def close(self) -> None:
        """Delete everything; closing twice is allowed."""
        with self._lock:
            if self.closed:
                return
            self.closed = True
            self.discovery.close()
            self.graph.close()
            for wait_set in self._wait_sets:
                wait_set.close()
            for endpoint in self._endpoints:
                endpoint.close()
            for topic in self._topics.values():
                topic.__del__()
            self._wait_sets.clear()
            self._endpoints.clear()
            self._topics.clear()
            self._entity.__del__()
            _domains.release(self.domain_id)

    def _open_entity(self) -> DomainParticipant:
        if self.closed:
            raise InvalidHandle("the context is shut down")
        return self._entity

    def _topic(self, name: str, full_name: str, *, service: bool) -> Topic[Any]:
        key = (name, full_name)
        if key not in self._topics:
            descriptor = descriptors.topic_descriptor(full_name, service=service)
            self._topics[key] = Topic(self._open_entity(), name, descriptor)
        return self._topics[key]

    def _service_tag(self, key: str) -> bytes:
        with self._lock:
            self._service_ends += 1
            gid = self.gid[:12] + struct.pack(">I", self._service_ends)
        return (f"{key}=" + ".".join(f"{byte:02x}" for byte in gid) + ";").encode()


def _qos(full_name: str, policies: Iterable[Any], service_id: bytes) -> Qos:
    user_data = service_id + f"typehash={message_type_hash(full_name)};".encode()
    return Qos(
        *policies,
        # XCDR1 alone: what ROS 2 speaks.
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.Userdata(user_data),
    )
