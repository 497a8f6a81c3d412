# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``ros_discovery_info``: which nodes a participant has, and which endpoints are whose."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
from cyclonedds.core import Policy

from ..types import message_class
from ..types.cdr import serialize
from .endpoints import Reader, Writer

if TYPE_CHECKING:
    from .participant import Participant

TOPIC = "ros_discovery_info"
TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
MAX_BLOCKING_NS = 100_000_000

# Latched, one sample a participant: rmw_dds_common's choice.
WRITER_POLICIES = (
    Policy.Reliability.Reliable(MAX_BLOCKING_NS),
    Policy.History.KeepLast(1),
    Policy.Durability.TransientLocal,
    Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
)
READER_POLICIES = (
    Policy.Reliability.Reliable(MAX_BLOCKING_NS),
    Policy.History.KeepAll,
    Policy.Durability.TransientLocal,
)

NodeKey = tuple[str, str]  # namespace, name


class DiscoveryInfo:
    """Announces this participant's nodes whenever they change."""

    def __init__(self, participant: Participant) -> None:
        self._participant = participant
        self._lock = threading.Lock()
        self._nodes: dict[NodeKey, tuple[list[bytes], list[bytes]]] = {}
        self._writer = participant.create_writer(TOPIC, TYPE, WRITER_POLICIES)

    def add_node(self, node: NodeKey) -> None:
        """Announce a node."""
        with self._lock:
            self._nodes.setdefault(node, ([], []))
            self._announce()

    def remove_node(self, node: NodeKey) -> None:
        """Withdraw a node and its endpoints."""
        with self._lock:
            self._nodes.pop(node, None)
            self._announce()

    def add_endpoints(self, node: NodeKey, *endpoints: Reader | Writer) -> None:
        """Announce that endpoints belong to a node."""
        with self._lock:
            readers, writers = self._nodes.setdefault(node, ([], []))
            for endpoint in endpoints:
                (readers if isinstance(endpoint, Reader) else writers).append(endpoint.gid)
            self._announce()

    def remove_endpoints(self, node: NodeKey, *endpoints: Reader | Writer) -> None:
        """Withdraw endpoints of a node."""
        with self._lock:
            readers, writers = self._nodes.get(node, ([], []))
            for endpoint in endpoints:
                gids = readers if isinstance(endpoint, Reader) else writers
                if endpoint.gid in gids:
                    gids.remove(endpoint.gid)
            self._announce()

    def close(self) -> None:
        """Stop announcing."""
        self._participant.close_endpoint(self._writer)

    def _announce(self) -> None:
        if self._writer.closed:
            return
        info_class: Any = message_class(TYPE)
        node_class: Any = message_class("rmw_dds_common/msg/NodeEntitiesInfo")
        info = info_class(
            gid=_gid(self._participant.gid),
            node_entities_info_seq=[
                node_class(
                    node_namespace=namespace,
                    node_name=name,
                    reader_gid_seq=[_gid(gid) for gid in readers],
                    writer_gid_seq=[_gid(gid) for gid in writers],
                )
                for (namespace, name), (readers, writers) in self._nodes.items()
            ],
        )
        self._writer.write(serialize(info))


def _gid(value: bytes) -> Any:
    cls: Any = message_class("rmw_dds_common/msg/Gid")
    return cls(data=np.frombuffer(value, np.uint8))
