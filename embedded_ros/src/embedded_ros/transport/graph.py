# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is discovered in the domain: nodes and endpoints, ours and other processes'.

Read on demand from CycloneDDS's own caches: there is no thread and nothing to keep up to date.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from cyclonedds._clayer import ddspy_read_endpoint, ddspy_read_participant
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.builtin_types import cqos_to_qos
from cyclonedds.core import InstanceState, Qos, SampleState, ViewState
from cyclonedds.domain import DomainParticipant

from ..types.cdr import deserialize
from . import discovery, names
from .endpoints import Reader

if TYPE_CHECKING:
    from .participant import Participant

_ALL = 10_000  # samples: more than there can be
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A discovered reader or writer."""

    gid: bytes
    participant: bytes
    topic_name: str  # DDS's, with its prefix
    type_name: str  # DDS's
    qos: Qos | None


class Graph:
    """A view of the domain."""

    def __init__(self, participant: Participant, entity: DomainParticipant) -> None:
        self._participant = participant
        self._lock = threading.Lock()
        self._participants = BuiltinDataReader(entity, BuiltinTopicDcpsParticipant)
        self._publications = _Endpoints(entity, BuiltinTopicDcpsPublication)
        self._subscriptions = _Endpoints(entity, BuiltinTopicDcpsSubscription)
        self._nodes: Reader = participant.create_reader(
            discovery.TOPIC, discovery.TYPE, discovery.READER_POLICIES
        )
        self._info: dict[bytes, Any] = {}  # by participant
        self._seen: set[bytes] = set()  # participants alive at the last look

    def writers(self, *, qos_on: str | None = None) -> list[Endpoint]:
        """Every writer in the domain, those on the DDS topic ``qos_on`` with their QoS."""
        with self._lock:
            return self._publications.read(qos_on)

    def readers(self, *, qos_on: str | None = None) -> list[Endpoint]:
        """Every reader in the domain, those on the DDS topic ``qos_on`` with their QoS."""
        with self._lock:
            return self._subscriptions.read(qos_on)

    def nodes(self) -> list[tuple[str, str]]:
        """Name and namespace of every node in the domain."""
        return [
            (node.node_name, node.node_namespace)
            for info in self._live_info()
            for node in info.node_entities_info_seq
        ]

    def owner(self, gid: bytes) -> tuple[str, str] | None:
        """Name and namespace of the node that an endpoint belongs to, or None if unknown."""
        for info in self._live_info():
            for node in info.node_entities_info_seq:
                for owned in (*node.reader_gid_seq, *node.writer_gid_seq):
                    if owned.data.tobytes() == gid:
                        return node.node_name, node.node_namespace
        return None

    def gids_of_node(self, name: str, namespace: str) -> set[bytes]:
        """The endpoints of a node."""
        return {
            gid.data.tobytes()
            for info in self._live_info()
            for node in info.node_entities_info_seq
            if (node.node_name, node.node_namespace) == (name, namespace)
            for gid in (*node.reader_gid_seq, *node.writer_gid_seq)
        }

    def close(self) -> None:
        """Delete the readers."""
        with self._lock:
            _close(self._participants)
            self._publications.close()
            self._subscriptions.close()
            self._participant.close_endpoint(self._nodes)

    def _live_info(self) -> Iterator[Any]:
        with self._lock:
            while (sample := self._nodes.take()) is not None:
                info = deserialize(sample.data, discovery.TYPE)
                self._info[info.gid.data.tobytes()] = info
            alive = self._live_participants()
            # Only who was here and has gone is forgotten: what a participant announces can arrive
            # before CycloneDDS lists the participant itself, and is not sent again.
            for gone in self._seen - alive:
                self._info.pop(gone, None)
            self._seen = alive
            found = [info for gid, info in self._info.items() if gid in alive]
        yield from found

    def _live_participants(self) -> set[bytes]:
        samples = ddspy_read_participant(self._participants._ref, _ALL, _participant_key, _no_qos)
        return set() if isinstance(samples, int) else {key for key in samples if key is not None}


class _Endpoints:
    """Every writer, or every reader, in the domain.

    The QoS of each is converted once: CycloneDDS's Python layer does not give back the copy of the
    user data that it is handed (11.0.1), and who watches another node asks many times.
    """

    def __init__(self, entity: DomainParticipant, topic: Any) -> None:
        self._reader = BuiltinDataReader(entity, topic)
        self._qos: dict[bytes, Qos] = {}  # by endpoint, of those that were asked for

    def read(self, qos_on: str | None) -> list[Endpoint]:
        make = partial(self._endpoint, qos_on)
        samples = ddspy_read_endpoint(self._reader._ref, _ALL, make, _qos_pointer)
        found = [] if isinstance(samples, int) else [s for s in samples if s is not None]
        self._qos = {e.gid: self._qos[e.gid] for e in found if e.gid in self._qos}
        return found

    def close(self) -> None:
        _close(self._reader)

    def _endpoint(
        self,
        qos_on: str | None,
        key: bytes,
        participant: bytes,
        participant_handle: int,
        topic_name: str,
        type_name: str,
        qos_pointer: int,
        info: Any,
        type_id: bytes | None,
    ) -> Endpoint | None:
        if info.instance_state != InstanceState.Alive or not info.valid_data:
            return None
        qos = None
        if topic_name == qos_on:
            # The pointer is CycloneDDS's, and valid as long as this runs.
            qos = self._qos.get(key) or self._qos.setdefault(key, cqos_to_qos(qos_pointer))
        return Endpoint(key, participant, topic_name, type_name, qos)


def _close(reader: BuiltinDataReader) -> None:
    reader._next_condition.__del__()
    reader.__del__()


def _participant_key(key: bytes, qos: object, info: Any) -> bytes | None:
    return key if info.instance_state == InstanceState.Alive and info.valid_data else None


def _no_qos(pointer: int) -> None:
    return None


def _qos_pointer(pointer: int) -> int:
    """Leave the QoS as it is: to convert it takes 0.1 ms, and few are asked for."""
    return pointer


def topics(endpoints: list[Endpoint]) -> dict[str, set[str]]:
    """ROS topics and their types."""
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        topic, kind = names.ros_topic(endpoint.topic_name), names.ros_type(endpoint.type_name)
        if topic and kind:
            found.setdefault(topic, set()).add(kind)
    return found


def services(endpoints: list[Endpoint]) -> dict[str, set[str]]:
    """ROS services and their types, from readers of requests or writers of them."""
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        service, kind = names.ros_service(endpoint.topic_name), names.ros_type(endpoint.type_name)
        if service and kind:
            found.setdefault(service, set()).add(names.service_type(kind))
    return found
