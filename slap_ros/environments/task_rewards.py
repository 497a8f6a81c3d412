# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rewards of a whole task: sparse; by the potential that shortcuts get; or stage after stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slap_ros.environments.episode import TaskEpisode
from slap_ros.planning.plan import PlanEdge
from slap_ros.planning.problem import ground_options
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import LiftedOperator, Object, RewardTemplate, State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.signature import Change, Signature

REWARDS = Rewards()  # as shortcuts are learned with
STAGE = REWARDS.scale * REWARDS.success  # for the end of a stage


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


class MetricReward:
    """The gain of the weighted metrics that people wrote for a skill (LG-SAIL Eq. 3), and its end.

    In all, a stage is worth :data:`STAGE` for its metrics, and as much for its end.
    """

    def __init__(
        self,
        state: State,
        operator: LiftedOperator,
        objects: Sequence[Object],
        template: RewardTemplate,
    ) -> None:
        """Begin in a state.

        Args:
            state: State in which the stage begins.
            operator: Operator of the stage.
            objects: Objects that it is applied to.
            template: Dense part of the operator's reward.
        """
        self._objects = dict(zip(operator.parameters, objects, strict=True))
        self._terms = template.terms
        self._before = self._value(state)

    def _value(self, state: State) -> float:
        return sum(term.weight * term.value(state, self._objects) for term in self._terms)

    def of(self, state: State, reached: bool) -> float:
        """See :meth:`PotentialReward.of`."""
        value = 1.0 if reached else self._value(state)
        gain, self._before = value - self._before, value
        return STAGE * (gain + reached)


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

    Where people wrote rewards for skills, as at the benches, these are the dense part; elsewhere
    it is the potential that shortcuts get. The plan is a shortest one, and no skill is run for it:
    what a learner is rewarded for does not depend on how good our skills are.
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
        self._edges = list(edges)
        self._stages = len(edges)
        self._enter(episode)

    @property
    def progress(self) -> float:
        """Share of the plan's stages that were done in order; 1 where there are none."""
        return 1.0 - len(self._edges) / self._stages if self._stages else 1.0

    def _enter(self, episode: TaskEpisode) -> None:
        """Begin the next stage, if there is one."""
        self._dense: PotentialReward | MetricReward | None = None
        if self._edges:
            episode.stage = self._edges[0].option.objects
            self._dense = _dense_reward(episode, self._edges[0])

    def of(self, episode: TaskEpisode) -> float:
        """See the class."""
        if self._dense is None:
            return 0.0
        reached = self._edges[0].target.reached(episode.abstract)
        reward = self._dense.of(episode.state, reached)
        if reached:
            del self._edges[0]
            self._enter(episode)
        return reward


def _dense_reward(episode: TaskEpisode, edge: PlanEdge) -> PotentialReward | MetricReward:
    """What is paid on the way to the end of a plan's first edge, from the newest state."""
    name, objects = edge.option.skill.name, edge.option.objects
    written = episode.domain.acquisition
    if written is not None:
        for operator in written.operators:
            if operator.name == name and _fits(operator, objects):
                return MetricReward(episode.state, operator, objects, written.rewards[name])
    change = Change.between(episode.abstract, edge.target.required)
    return PotentialReward(episode, change)


def _fits(operator: LiftedOperator, objects: Sequence[Object]) -> bool:
    """Whether an operator can be applied to objects: one of another author may have others."""
    parameters = operator.parameters
    return len(parameters) == len(objects) and all(
        one.type.is_a(variable.type) for one, variable in zip(objects, parameters, strict=True)
    )
