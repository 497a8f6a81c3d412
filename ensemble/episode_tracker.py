# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which episode is under way, from the latched topics ``domain`` and ``task``."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from slap_msgs.msg import DomainInfo
from slap_msgs.msg import Task as TaskMessage

from ensemble.interfaces import DOMAIN, TASK, Topic
from ensemble.observation import Episode
from slap_ros.core import Task
from slap_ros.domains import get_domain
from slap_ros.messages.decode import decode_goal, decode_state, stamp_ns


def subscribe(node: Node, topic: Topic, callback: Callable[..., None]) -> None:
    """Subscribe with the topic's own QoS.

    Args:
        node: Who subscribes.
        topic: What to.
        callback: Called with each message.
    """
    node.create_subscription(topic.type, topic.name, callback, topic.qos)


class EpisodeTracker:
    """Follows ``slap/domain`` and ``slap/task``, which may arrive in either order.

    An UnknownDomainError comes out of the callbacks, and so out of ``spin``, where the simulator
    runs a domain that is not installed here.
    """

    def __init__(self, node: Node, on_episode: Callable[[Episode], None]) -> None:
        """``on_episode`` is called for each new episode."""
        self.current: Episode | None = None
        self._on_episode = on_episode
        self._domain: DomainInfo | None = None
        self._task: TaskMessage | None = None
        subscribe(node, DOMAIN, self._on_domain)
        subscribe(node, TASK, self._on_task)

    # What is latched is sent again when two nodes find each other again after a moment of silence.
    # That is no new episode.

    def _on_domain(self, message: DomainInfo) -> None:
        if message != self._domain:
            self._domain = message
            self._open()

    def _on_task(self, message: TaskMessage) -> None:
        if message != self._task:
            self._task = message
            self._open()

    def _open(self) -> None:
        if self._domain is None or self._task is None or self._domain.name != self._task.domain:
            return
        domain = get_domain(self._domain.name, self._domain.preset)
        initial = decode_state(self._task.initial_state, domain.types_by_name)
        space = domain.atom_space(initial)
        goal = decode_goal(self._task.goal, space)
        task = Task(initial, goal, self._task.step_limit)
        opened_ns = stamp_ns(self._task.header)
        self.current = Episode(self._task.episode, opened_ns, domain, task, space)
        self._on_episode(self.current)
