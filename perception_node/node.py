# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Turns states into ground atoms. The place for a lab's own detectors.

Publishers:
    slap/atoms (slap_msgs/AbstractState): the ground atoms of each state.
    /diagnostics (diagnostic_msgs/DiagnosticArray): states perceived; 1 Hz.

Subscribers:
    slap/domain (slap_msgs/DomainInfo), slap/task (slap_msgs/Task): what to perceive.
    slap/state (slap_msgs/ObjectCentricState): perceived one by one.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from rclpy.node import Node
from slap_msgs.msg import AbstractState, ObjectCentricState

from ensemble import encode
from ensemble.heartbeat import Heartbeat
from ensemble.interfaces import ATOMS, STATE
from ensemble.observation import Episode, EpisodeWatcher, subscribe
from ensemble.running import run_node
from slap_ros.errors import InvalidStateError
from slap_ros.messages.decode import decode_state


class PerceptionNode(Node):
    """Perception by the domain's own predicates."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("perception_node", **kwargs)
        self._perceived = 0
        self._waiting: deque[ObjectCentricState] = deque()
        self._atoms = self.create_publisher(ATOMS.type, ATOMS.name, ATOMS.qos)
        self._watcher = EpisodeWatcher(self, lambda _: self._perceive_waiting())
        subscribe(self, STATE, self._on_state)
        Heartbeat(self, lambda: {"states": self._perceived})

    def _on_state(self, message: ObjectCentricState) -> None:
        self._waiting.append(message)
        self._perceive_waiting()

    def _perceive_waiting(self) -> None:
        """States may arrive before the task that says what they consist of."""
        episode = self._watcher.current
        while episode is not None and self._waiting:
            if episode.has(self._waiting[0]):
                self._perceive(self._waiting.popleft(), episode)
            elif episode.follows(self._waiting[0]):
                self._waiting.popleft()
            else:
                return  # its task is still to come

    def _perceive(self, message: ObjectCentricState, episode: Episode) -> None:
        try:
            state = decode_state(message, episode.domain.types_by_name)
        except InvalidStateError as error:
            self.get_logger().error(f"state of step {message.step} not perceived: {error}")
            return
        abstract = episode.space.abstract(state)
        self._atoms.publish(
            AbstractState(
                header=message.header,
                episode=message.episode,
                step=message.step,
                atoms=encode.atoms(episode.space.decode(abstract)),
            )
        )
        self._perceived += 1


def main() -> int:
    """Run the node."""
    return run_node("perception_node", PerceptionNode)
