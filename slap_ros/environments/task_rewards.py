# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rewards of a whole task: sparse; by the potential that shortcuts get; or stage after stage."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from slap_ros.environments.episode import TaskEpisode
from slap_ros.planning.problem import ground_options
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.signature import Change, Signature

REWARDS = Rewards()  # as shortcuts are learned with


class TaskReward(Protocol):
    """The reward of each step of an episode."""

    def begin(self, episode: TaskEpisode) -> None:
        """An episode begins."""
        ...

    def of(self, episode: TaskEpisode) -> float:
        """The reward of the step that led to the episode's newest state."""
        ...


class SparseReward:
    """-1 for each step, and 0 for the one that reaches the goal."""

    def begin(self, episode: TaskEpisode) -> None:
        """Nothing is to be remembered."""

    def of(self, episode: TaskEpisode) -> float:
        """See the class."""
        return 0.0 if episode.solved else -1.0


class PotentialReward:
    """The gain of a potential on the way to some atoms, and a reward once they hold."""

    def __init__(self, episode: TaskEpisode, change: Change) -> None:
        """Begin in the episode's newest state.

        Args:
            episode: Episode whose states are judged.
            change: Change of atoms that is rewarded.
        """
        signature = Signature.of(change, episode.space)
        self._encoder = ObservationEncoder(episode.domain, episode.space, signature, change)
        self._before = self._potential(episode.state)

    def _potential(self, state: State) -> float:
        return float(self._encoder.encode(state.alone()).potential[0])

    def of(self, state: State, reached: bool) -> float:
        """The reward of a step.

        Args:
            state: State after the step.
            reached: Whether the atoms hold there as they shall.
        """
        potential = 0.0 if reached else self._potential(state)
        gain, self._before = potential - self._before, potential
        success, failure = np.array([reached]), np.array([False])
        return float(REWARDS.of(np.array([gain]), success, failure)[0])


class DenseReward:
    """The gain of the potential on the way to the goal, as if it were a shortcut's target."""

    _potential: PotentialReward | None = None

    def begin(self, episode: TaskEpisode) -> None:
        """See the class.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        learner_interface(episode.domain)
        missing = episode.goal & ~episode.abstract
        self._potential = PotentialReward(episode, Change(missing, 0)) if missing else None

    def of(self, episode: TaskEpisode) -> float:
        """See the class."""
        if self._potential is None:
            return 0.0
        return self._potential.of(episode.state, episode.solved)


class StagedReward:
    """The targets of a plan of operators, one after the other; dense on the way to each.

    The plan is a shortest one, and no skill is run for it: what a learner is rewarded for does not
    depend on how good our skills are.
    """

    def begin(self, episode: TaskEpisode) -> None:
        """Make the plan whose targets are the stages.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
            NoSkillsError: The domain has no operators.
            UnsolvableError: The task has no plan.
        """
        planner = SymbolicPlanner(episode.space, ground_options(episode.domain, episode.space))
        edges = planner.edges(episode.abstract, episode.goal)
        self._targets = [edge.target for edge in edges]
        self._objects = [edge.option.objects for edge in edges]
        self._stages = len(self._targets)
        self._enter(episode)

    @property
    def progress(self) -> float:
        """Share of the plan's stages that were done in order; 1 where there are none."""
        return 1.0 - len(self._targets) / self._stages if self._stages else 1.0

    def _enter(self, episode: TaskEpisode) -> None:
        """Begin the next stage, if there is one."""
        self._potential: PotentialReward | None = None
        if self._targets:
            episode.stage = self._objects[-len(self._targets)]
            now, then = episode.abstract, self._targets[0].required
            self._potential = PotentialReward(episode, Change.between(now, then))

    def of(self, episode: TaskEpisode) -> float:
        """See the class."""
        if self._potential is None:
            return 0.0
        reached = self._targets[0].reached(episode.abstract)
        reward = self._potential.of(episode.state, reached)
        if reached:
            del self._targets[0]
            self._enter(episode)
        return reward
