# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Turns states into ground atoms. The place for a lab's own detectors.

By default perception is exact. With noise, movable objects are perceived a little off their true
place, and planner and skill server know the perceived place only.

ROS Parameters:
    position_noise (double, 0.0): m, standard deviation of positions along each axis.
    turn_noise (double, 0.0): rad, standard deviation of orientations about each axis.
    threshold_noise (double, 0.0): standard deviation of predicates' thresholds, in the unit of the
        predicate's metric: m or rad.
    dropout (double, 0.0): share of the detections of an object that are lost.
    hidden (string, ""): objects that are never detected, separated by blanks; they are missing
        unless they are in the hand.
    memory (int, 40): environment steps for which an object that is not detected is taken to be
        where it was; then it is missing, and a skill that is about it ends with NO_DETECTION.
    debounce (int, 1): how many times in a row an atom must be perceived as changed to change.
    noise_seed (int, 0): noise is a function of it, of the episode and of its states.
    domain (string, ""), preset (string, ""): imported before the node has servers; empty: whichever
        the simulator announces, in a thread.
    skills (string, ""): whose skills the domain has: none, demonstrator, or a library's folder;
        empty: whichever the simulator announces. A domain that is announced with others is refused.
    libraries (string, "runs/skills"): folders below which a library that slap/skills names may lie,
        separated by ':'; others are refused.
    patience (double, 1.0): factor of all deadlines, for slow domains and machines.

Publishers:
    slap/atoms (slap_msgs/AbstractState): the ground atoms of each state, and what else is perceived
        otherwise than it is.
    slap/fault (slap_msgs/EpisodeFault): why nothing is perceived any more: a predicate raised.
    diagnostics (diagnostic_msgs/DiagnosticArray): states perceived, messages refused; 1 Hz.

Subscribers:
    slap/domain (slap_msgs/DomainInfo), slap/task (slap_msgs/Task): what to perceive.
    slap/skills (slap_msgs/SkillLibrary): acquired skills, taken on when an episode has them.
    slap/state (slap_msgs/ObjectCentricState): perceived one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from rclpy.node import Node
from slap_msgs.msg import ObjectCentricState

from ensemble import encode
from ensemble.answering import domain_error
from ensemble.common_parameters import read_with_common
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.early_messages import EarlyMessages
from ensemble.endpoints import subscribe
from ensemble.entry_point import run_node
from ensemble.episode_tracker import EpisodeTracker
from ensemble.interfaces import ATOMS, FAULT, STATE
from ensemble.next_states import NextStates
from ensemble.observation import Episode
from ensemble.perception_parameters import PerceptionParameters
from ensemble.refusals import Refusals
from slap_ros.errors import SlapError
from slap_ros.messages import qos
from slap_ros.messages.decode import decode_state
from slap_ros.perception import ExactPerceiver, NoisyPerceiver, Perceiver

AFTER_LAST = 2**32  # above all that a message can have


class PerceptionNode(Node):
    """Perception by the domain's own predicates, as well as the parameters allow."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("perception_node", **kwargs)
        parameters, common = read_with_common(self, PerceptionParameters)
        common.imported()
        self._quality, self._seed = parameters.quality, parameters.noise_seed
        self._perceiver: Perceiver
        self._perceived = 0
        self._states = NextStates(0)  # of the current episode
        self._atoms = self.create_publisher(ATOMS.type, ATOMS.name, ATOMS.qos)
        self._faults = self.create_publisher(FAULT.type, FAULT.name, FAULT.qos)
        self._refusals = Refusals(self)
        self._episodes = EpisodeTracker(
            self, self._perceiver_of, self._open, self._refusals, common
        )
        self._early: EarlyMessages[ObjectCentricState] = EarlyMessages(
            qos.EPISODE.depth, lambda message: message, self._episodes.expects
        )
        subscribe(self, STATE, self._on_state)
        DiagnosticsPublisher(self, lambda: {"states": self._perceived, **self._refusals.counts})

    def destroy_node(self) -> None:
        """Stop the thread as well."""
        self._episodes.destroy()
        super().destroy_node()

    def _open(self, episode: Episode, perceiver: Perceiver) -> None:
        self._perceiver = perceiver
        assert self._episodes.opened is not None
        first = self._episodes.opened.initial_state
        earlier = self._early.take(episode)
        self._states = NextStates(0)
        self._take(first, episode)
        if (
            len(earlier) >= qos.EPISODE.depth
        ):  # joined so late that publishers keep the first no more
            self._states.step = min(message.step for message in earlier)
        for message in sorted(earlier, key=lambda message: message.step):
            self._take(message, episode)

    def _perceiver_of(self, episode: Episode) -> Perceiver:
        if self._quality.exact:
            return ExactPerceiver(episode.space)
        rng = np.random.default_rng([self._seed, episode.number])
        initial = episode.task.initial_state
        return NoisyPerceiver.of(episode.domain, episode.space, initial, self._quality, rng)

    def _on_state(self, message: ObjectCentricState) -> None:
        episode = self._episodes.current
        if episode is not None and episode.has(message):
            self._take(message, episode)
        else:
            self._early.add(message)  # of an episode whose task is still to come, perhaps

    def _take(self, message: ObjectCentricState, episode: Episode) -> None:
        """Perceive a state once it is its turn, and those that waited for it."""
        self._states.add(message)
        while (following := self._states.pop()) is not None:
            self._perceive(following, episode)

    def _perceive(self, message: ObjectCentricState, episode: Episode) -> None:
        """Perceive a state; one that cannot be perceived leaves its turn to another."""
        try:
            state = decode_state(message, episode.domain.types_by_name)
            percept = self._perceiver.perceive(state)
        except SlapError as error:
            self._refusals.add("refused_states", f"step {message.step} not perceived: {error}")
            return
        except Exception as raised:  # of a domain's predicate
            self._fail(domain_error(self, episode.domain.name, raised), episode, message)
            return
        self._states.step = message.step + 1
        self._atoms.publish(encode.percept(percept, message, episode.space, state))
        self._perceived += 1

    def _fail(self, error: SlapError, episode: Episode, message: ObjectCentricState) -> None:
        """End the episode: what comes of it later is not perceived."""
        self._states = NextStates(AFTER_LAST)
        fault = encode.fault(error, episode.number, episode.opened_ns, message.step)
        self._faults.publish(fault)
        self.get_logger().error(f"step {message.step} not perceived: {error}")


def main() -> int:
    """Run the node."""
    return run_node("perception_node", PerceptionNode)
