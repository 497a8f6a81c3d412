# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Waiting for a single message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .executors import SingleThreadedExecutor
from .qos import QoSProfile
from .task import Future

if TYPE_CHECKING:
    from .node import Node


def wait_for_message(
    msg_type: type[Any],
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[bool, Any]:
    """Wait for the next message on a topic; never from a callback of the node.

    Args:
        msg_type: The message's class.
        node: The node to subscribe with; taken off its executor meanwhile.
        topic: The topic.
        qos_profile: QoS of the subscription.
        time_to_wait: Seconds, for ever where negative.

    Returns:
        Whether one came, and the message.
    """
    received: Future[Any] = Future()

    def keep(message: Any) -> None:
        if not received.done():
            received.set_result(message)

    previous = node.executor
    subscription = node.create_subscription(msg_type, topic, keep, qos_profile)
    executor = SingleThreadedExecutor(context=node.context)
    try:
        executor.add_node(node)
        executor.spin_until_future_complete(received, None if time_to_wait < 0 else time_to_wait)
    finally:
        executor.shutdown()
        node.destroy_subscription(subscription)
        node.executor = previous
    return received.done(), received.result() if received.done() else None
