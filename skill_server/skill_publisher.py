# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the skill server publishes: commands, and what happens to each skill."""

from __future__ import annotations

from collections import Counter

from rclpy.node import Node
from slap_msgs.msg import SkillEvent

from ensemble import encode
from ensemble.interfaces import COMMAND, SKILL_EVENTS
from ensemble.observation import Observation
from slap_ros.core import Action
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import Option


class SkillPublisher:
    """Publishes commands and skill events, and counts the events."""

    def __init__(self, node: Node) -> None:
        """Publish as ``node``."""
        self._node = node
        self._counts: Counter[int] = Counter()  # of SkillEvent kinds
        self._commands = node.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        self._events = node.create_publisher(SKILL_EVENTS.type, SKILL_EVENTS.name, SKILL_EVENTS.qos)

    @property
    def counts(self) -> dict[str, int]:
        """Events so far, by kind."""
        return {
            "started": self._counts[SkillEvent.STARTED],
            "reached": self._counts[SkillEvent.REACHED],
            "failed": self._counts[SkillEvent.FAILED],
            "canceled": self._counts[SkillEvent.CANCELED],
        }

    def command(self, action: Action, at: Observation) -> None:
        """Publish the action that answers an observation."""
        now = self._node.get_clock().now().to_msg()
        actions = at.episode.domain.action_space
        self._commands.publish(encode.command(action, actions, at.episode.number, at.step, now))

    def event(self, kind: int, option: Option, at: Observation, outcome: OptionResult) -> None:
        """Publish a SkillEvent.

        Args:
            kind: One of SkillEvent's.
            option: What it happens to.
            at: When: the newest observation.
            outcome: How the option ended; an error code of NONE where it did not.
        """
        self._counts[kind] += 1
        now = self._node.get_clock().now().to_msg()
        episode, step = at.episode.number, at.step
        self._events.publish(encode.skill_event(kind, option, outcome, episode, step, now))
