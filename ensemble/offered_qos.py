# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions to what a robot's driver may publish: with the QoS that is offered."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ensemble.interfaces import Topic
from ensemble.steady_time import create_timer

PERIOD = 0.1  # s, between two looks at who publishes


def subscribe_as_offered(
    node: Node, topic: Topic, callback: Callable[..., None], **options: Any
) -> None:
    """Subscribe as soon as somebody publishes, with as much as all of them offer.

    The simulator keeps its past for those who come late. Whoever asks for that hears no driver,
    which keeps nothing.

    Args:
        node: Node that subscribes.
        topic: What to. Its own QoS is the most that is asked for.
        callback: Called with each message.
        options: Options of the subscription, such as ``raw``.
    """
    name = node.resolve_topic_name(topic.name)

    def look() -> None:
        offered = [info.qos_profile for info in node.get_publishers_info_by_topic(name)]
        if offered:
            node.destroy_timer(timer)
            qos = _least(offered, topic.qos.depth)
            node.create_subscription(topic.type, topic.name, callback, qos, **options)

    timer = create_timer(node, PERIOD, look)


def _least(offered: Collection[QoSProfile], depth: int) -> QoSProfile:
    """What is compatible with every publisher."""
    reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offered)
    kept = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offered)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if kept else DurabilityPolicy.VOLATILE,
    )
