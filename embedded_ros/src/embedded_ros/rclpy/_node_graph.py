# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node can find out about the other nodes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from embedded_ros.transport import graph as dds
from embedded_ros.transport import names, user_data
from embedded_ros.transport.graph import Endpoint, Graph

from ._dds_qos import from_qos
from .topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from .type_hash import TypeHash

if TYPE_CHECKING:
    from .context import Context

NamesAndTypes = list[tuple[str, list[str]]]

_TYPE_HASH = re.compile(r"RIHS(\d\d)_([0-9a-f]{64})")


class NodeGraph:
    """Asks the DDS graph in ROS's terms."""

    def __init__(self, context: Context) -> None:
        self._context = context

    def nodes(self) -> list[tuple[str, str]]:
        """Name and namespace of every node."""
        return self._graph.nodes()

    def topics(self) -> NamesAndTypes:
        """Every topic that is published or subscribed to."""
        return _sorted(dds.topics([*self._graph.writers(), *self._graph.readers()]))

    def services(self) -> NamesAndTypes:
        """Every service that is served or used."""
        return _sorted(dds.services([*self._graph.writers(), *self._graph.readers()]))

    def topics_of(self, name: str, namespace: str, *, writers: bool) -> NamesAndTypes:
        """The topics that a node publishes, or subscribes to."""
        return _sorted(dds.topics(self._endpoints_of(name, namespace, writers=writers)))

    def services_of(self, name: str, namespace: str, *, served: bool) -> NamesAndTypes:
        """The services that a node serves, or uses."""
        found = self._endpoints_of(name, namespace, writers=not served)
        return _sorted(dds.services([e for e in found if e.topic_name.startswith("rq/")]))

    def count(self, topic: str, *, writers: bool) -> int:
        """How many publishers or subscriptions a topic has."""
        return len(self._endpoints_on(names.topic(topic), writers=writers))

    def count_service_ends(self, service: str, *, served: bool) -> int:
        """How many servers or clients a service has."""
        return len(self._endpoints_on(names.request_topic(service), writers=not served))

    def info(self, topic: str, *, writers: bool) -> list[TopicEndpointInfo]:
        """The publishers or subscriptions of a topic."""
        graph = self._graph
        kind = TopicEndpointTypeEnum.PUBLISHER if writers else TopicEndpointTypeEnum.SUBSCRIPTION
        infos = []
        for endpoint in self._endpoints_on(names.topic(topic), writers=writers, with_qos=True):
            assert endpoint.qos is not None
            name, namespace = graph.owner(endpoint.gid) or (
                "_NODE_NAME_UNKNOWN_",
                "_NODE_NAMESPACE_UNKNOWN_",
            )
            infos.append(
                TopicEndpointInfo(
                    name,
                    namespace,
                    names.ros_type(endpoint.type_name) or endpoint.type_name,
                    _type_hash(endpoint),
                    kind,
                    list(endpoint.gid),
                    from_qos(endpoint.qos),
                )
            )
        return infos

    @property
    def _graph(self) -> Graph:
        return self._context.participant.graph

    def _endpoints_on(
        self, dds_topic: str, *, writers: bool, with_qos: bool = False
    ) -> list[Endpoint]:
        find = self._graph.writers if writers else self._graph.readers
        endpoints = find(qos_on=dds_topic if with_qos else None)
        return [endpoint for endpoint in endpoints if endpoint.topic_name == dds_topic]

    def _endpoints_of(self, name: str, namespace: str, *, writers: bool) -> list[Endpoint]:
        gids = self._graph.gids_of_node(name, namespace)
        endpoints = self._graph.writers() if writers else self._graph.readers()
        return [endpoint for endpoint in endpoints if endpoint.gid in gids]


def _sorted(found: dict[str, set[str]]) -> NamesAndTypes:
    return [(name, sorted(found[name])) for name in sorted(found)]


def _type_hash(endpoint: Endpoint) -> TypeHash:
    match = _TYPE_HASH.fullmatch(user_data.value(endpoint, "typehash") or "")
    return TypeHash(int(match[1]), bytes.fromhex(match[2])) if match else TypeHash()
