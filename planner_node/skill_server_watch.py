# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the skill server that a run began with is still there."""

from __future__ import annotations

from time import monotonic

from rclpy.action import ActionClient
from rclpy.node import Node

from ensemble.interfaces import SKILL_EVENTS
from ensemble.node_liveness import NodeLiveness


class SkillServerWatch:
    """Watches the skill server from now on."""

    def __init__(self, node: Node, skills: ActionClient, timeout_s: float) -> None:
        """Begin to watch.

        Args:
            node: Node that watches.
            skills: Action client of the skill server.
            timeout_s: How long the server may be away, s.
        """
        self._node, self._skills, self._timeout_s = node, skills, timeout_s
        self._liveness = NodeLiveness(node, SKILL_EVENTS)
        self._alive_s = monotonic()  # when it was last there

    def is_lost(self) -> bool:
        """Whether it has been away for longer than it may."""
        if self._liveness.is_alive() and self._skills.server_is_ready():
            self._alive_s = monotonic()
        return monotonic() - self._alive_s > self._timeout_s
