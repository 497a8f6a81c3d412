# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether another node is still there, and still the same one."""

from __future__ import annotations

from time import monotonic

from rclpy.node import Node

from ensemble.interfaces import Topic

PERIOD = 0.5  # s between two queries of the graph, which cost time; DDS takes longer to miss a node


class NodeLiveness:
    """The nodes that were found to publish a topic.

    A node that died and was started again has the same name, and servers that are ready, but it
    knows nothing of what its predecessor was asked for. Its endpoints are others.
    """

    def __init__(self, node: Node, topic: Topic) -> None:
        """Follow the nodes that publish ``topic`` now or, if none does yet, the first that do."""
        self._node = node
        self._topic = node.resolve_topic_name(topic.name)
        self._known = self._now = self._publishers()
        self._queried_s = monotonic()

    def is_alive(self) -> bool:
        """Whether one of them is there."""
        if monotonic() - self._queried_s > PERIOD:
            self._now = self._publishers()
            self._known = self._known or self._now
            self._queried_s = monotonic()
        return not self._known.isdisjoint(self._now)

    def is_lost(self) -> bool:
        """Whether they were there and are gone; False as long as none was found."""
        return not self.is_alive() and bool(self._known)

    def _publishers(self) -> frozenset[tuple[int, ...]]:
        found = self._node.get_publishers_info_by_topic(self._topic)
        return frozenset(tuple(info.endpoint_gid) for info in found)
