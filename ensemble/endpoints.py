# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Publishers and subscriptions with a topic's own QoS, which parameters override where it is heavy.

As in every ROS 2 node: ``qos_overrides./slap/markers.publisher.reliability:=best_effort``.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSPolicyKind, QoSProfile
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions

from ensemble.interfaces import MARKERS, STATE, Topic
from slap_ros.errors import InvalidParameterError

OVERRIDABLE = (STATE, MARKERS)  # what grows with the world, and may have to cross a slow network
BACKLOG = 1000  # messages that may wait for a node
POLICIES = (
    QoSPolicyKind.HISTORY,
    QoSPolicyKind.DEPTH,
    QoSPolicyKind.RELIABILITY,
    QoSPolicyKind.DURABILITY,
)


def advertise(node: Node, topic: Topic) -> Publisher:
    """Publish a topic with its own QoS, or as parameters override it.

    Args:
        node: Node that publishes.
        topic: Topic to publish.

    Raises:
        InvalidParameterError: An override names a value that there is not.
    """
    if topic not in OVERRIDABLE:
        return node.create_publisher(topic.type, topic.name, topic.qos)
    return _overridden(node, node.create_publisher, topic)


def subscribe(node: Node, topic: Topic, callback: Callable[..., None], **options: Any) -> None:
    """Subscribe to a topic with its own QoS, or as parameters override it.

    More messages may wait here than a publisher keeps for late joiners, since all publishers share
    that room: with a depth of 1, the message of a stranger would take the place of the world's.

    Args:
        node: Node that subscribes.
        topic: Topic to subscribe to.
        callback: Called with each message.
        options: Options of the subscription, such as ``raw``.

    Raises:
        InvalidParameterError: An override names a value that there is not.
    """
    if topic in OVERRIDABLE:
        _overridden(node, node.create_subscription, topic, callback, **options)
        return
    qos = copy(topic.qos)
    qos.depth = max(qos.depth, BACKLOG)
    node.create_subscription(topic.type, topic.name, callback, qos, **options)


def _overridden(
    node: Node, create: Callable[..., Any], topic: Topic, *callback: object, **options: Any
) -> Any:
    overriding = QoSOverridingOptions(POLICIES, callback=_accepted)
    try:
        return create(
            topic.type,
            topic.name,
            *callback,
            copy(topic.qos),  # rclpy changes it in place
            qos_overriding_options=overriding,
            **options,
        )
    except (RuntimeError, InvalidQosOverridesError) as error:
        if not node.context.ok():  # a signal came meanwhile, and shut it down
            raise
        raise InvalidParameterError(f"parameters qos_overrides of {topic.name}: {error}") from error


def _accepted(qos: QoSProfile) -> SetParametersResult:
    """Whether a publisher or subscription can have this profile."""
    bounded = qos.history == HistoryPolicy.KEEP_LAST and qos.depth > 0
    return SetParametersResult(
        successful=bounded,
        reason="" if bounded else "history is keep_last, of a depth of 1 at least",
    )
