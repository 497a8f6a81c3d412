# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The skill MDP as a vectorised environment: many episodes side by side, from given states.

All episodes have the same fixed horizon. Success ends none of them: an agent that is paid for
coming near, and stopped once it arrives, earns most by hovering. It ends the skill in execution
alone. So all environments begin and end together, and the last step is a truncation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.acquisition.training.episodes import Episodes
from slap_ros.core import Domain, MakeVectorWorld, VectorWorld
from slap_ros.learning.shares import proportional_shares
from slap_ros.learning.vec_env import VecEnvStep
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import Layout, Object, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import Grounding, Groundings, Indices
from slap_ros.skills.observations import SIZE, SkillObserver
from slap_ros.skills.reward import SkillReward
from slap_ros.skills.stage_targets import StageTargets


@dataclass(frozen=True)
class Initiation:
    """A state in which a skill begins, the hand where the approach brought it.

    Args:
        state: State in which the skill begins.
        objects: Objects that the skill is applied to.
    """

    state: State
    objects: tuple[Object, ...]

    @property
    def grounding(self) -> Grounding:
        """The objects that the skill is applied to, and the layout of all objects."""
        return Grounding(self.state.layout, self.objects)


class SkillMdp:
    """The MDP of an operator's skill: observations and rewards of states."""

    def __init__(
        self,
        domain: Domain,
        reward: SkillReward,
        groundings: Groundings,
        dense_share: float = 1.0,
    ) -> None:
        """Bind a reward to a domain's features and a choice of groundings.

        Args:
            domain: Domain whose learner's interface is used.
            reward: Reward of the operator's skill.
            groundings: Groundings that states may belong to.
            dense_share: Factor of the weighted metrics in the reward; success is paid 1.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        self.domain, self.reward, self.groundings = domain, reward, groundings
        self.dense_share = dense_share
        self._observe, self._targets = SkillObserver(domain), StageTargets(domain, reward.operator)
        self.action_map = ActionMap(domain, gripper=True)

    def over(self, groundings: Groundings) -> SkillMdp:
        """The same MDP for states of other groundings."""
        return SkillMdp(self.domain, self.reward, groundings, self.dense_share)

    def observe(self, rows: Array, numbers: Indices) -> NDArray[np.float32]:
        """The observations in states.

        Args:
            rows: States as rows, shape (n, width).
            numbers: Number of the grounding of each state, shape (n,).

        Returns:
            Shape (n, SIZE).
        """
        observed = np.zeros((len(rows), SIZE), dtype=np.float32)
        for part in self.groundings.split(rows, numbers):
            observed[part.rows] = self._observe(part)
        return observed

    def rewards(self, rows: Array, numbers: Indices, begun: Array) -> tuple[Array, Bools]:
        """The rewards of arriving in states, and whether they are successes.

        Args:
            rows: States as rows, shape (n, width).
            numbers: Number of the grounding of each state, shape (n,).
            begun: States in which their episodes began, as rows, shape (n, width).

        Returns:
            Two arrays of shape (n,).
        """
        rewards, success = np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)
        for part in self.groundings.split(rows, numbers):
            first = begun[part.rows, : part.state.layout.size]
            success[part.rows] = self._targets.reached(part, first, self.reward.success(part))
            dense = self.dense_share * self.reward.dense(part)
            rewards[part.rows] = np.maximum(dense, success[part.rows].astype(np.float64))
        return rewards, success


class SkillVecEnv:
    """Episodes of one skill; those over the same objects are stepped together."""

    def __init__(
        self,
        mdp: SkillMdp,
        initiations: Sequence[Initiation],
        num_envs: int,
        horizon: int,
        seed: Sequence[int],
        first_round: int = 0,
        make_worlds: MakeVectorWorld | None = None,
    ) -> None:
        """Begin an episode in each environment.

        Args:
            mdp: MDP that gives observations and rewards.
            initiations: Initiation states, of which every episode draws one.
            num_envs: Number of environments.
            horizon: Environment steps of every episode.
            seed: Seed of the draws.
            first_round: Number of episodes that were run before in each environment: which ones are
                drawn next depends on it and the seed alone, so that training can be resumed here.
            make_worlds: Function that makes the domain's worlds; None for the domain's own.
        """
        self.mdp, self.num_envs, self.horizon = mdp, num_envs, horizon
        self.action_map = mdp.action_map
        self.rounds = first_round
        self._seed = tuple(seed)
        self._make_worlds = make_worlds or mdp.domain.make_vector_world
        self._starts = _starts(initiations, num_envs)
        self._rows = np.zeros((num_envs, mdp.groundings.width))
        self._numbers = np.zeros(num_envs, dtype=np.intp)
        self._made: dict[tuple[Layout, int], VectorWorld] = {}
        self._finished: list[Episodes] = []
        self.succeeded: Bools = np.zeros(num_envs, dtype=bool)  # by the episodes that ended last
        self._begin_round()

    def step(self, actions: Array) -> VecEnvStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`; no episode ends by success."""
        commands = self.action_map(np.asarray(actions, dtype=np.float64))
        for part, world in self._worlds:
            self._rows[part] = self.mdp.groundings.rows(world.step(commands[part]).data)
        self._trace.append(self._rows.copy())
        self._actions.append(np.array(actions, dtype=np.float32))
        rewards, success = self.mdp.rewards(self._rows, self._numbers, self._trace[0])
        self._success |= success
        final = self.mdp.observe(self._rows, self._numbers)
        last = len(self._actions) == self.horizon
        lengths = np.full(self.num_envs, len(self._actions), dtype=np.intp)
        self.observations = final
        if last:
            self._end_round()
        nobody = np.zeros(self.num_envs, dtype=bool)
        return VecEnvStep(self.observations, rewards, nobody, nobody, nobody | last, lengths, final)

    def take_episodes(self) -> Episodes | None:
        """The whole episodes since they were last taken; None where there is none."""
        if not self._finished:
            return None
        taken, self._finished = self._finished, []
        return Episodes(
            np.concatenate([episodes.states for episodes in taken]),
            np.concatenate([episodes.actions for episodes in taken]),
            np.concatenate([episodes.numbers for episodes in taken]),
            self.mdp.groundings,
        )

    def _end_round(self) -> None:
        self._finished.append(
            Episodes(
                np.stack(self._trace, axis=1),
                np.stack(self._actions, axis=1),
                self._numbers.copy(),
                self.mdp.groundings,
            )
        )
        self.succeeded = self._success
        self.rounds += 1
        self._begin_round()

    def _begin_round(self) -> None:
        """Draw the state in which every environment begins its next episode."""
        rng = np.random.default_rng((*self._seed, self.rounds))
        drawn, same = self._starts.draw(rng), Counter[Layout]()
        self._worlds: list[tuple[Indices, VectorWorld]] = []
        for part, begun in drawn:
            states, layout = [one.state for one in begun], begun[0].state.layout
            self._worlds.append((part, self._worlds_in(states, same[layout])))
            same[layout] += 1
            self._numbers[part] = [self.mdp.groundings.number(one.grounding) for one in begun]
            self._rows[part] = self.mdp.groundings.rows(State.batch(states).data)
        self._trace: list[Array] = [self._rows.copy()]
        self._actions: list[NDArray[np.float32]] = []
        self._success: Bools = np.zeros(self.num_envs, dtype=bool)
        self.observations = self.mdp.observe(self._rows, self._numbers)

    def _worlds_in(self, states: Sequence[State], number: int) -> VectorWorld:
        """Worlds in states over the same objects; those of earlier episodes, reset.

        Args:
            states: States of the worlds.
            number: Number of these worlds among those over the same objects, from 0.
        """
        key = states[0].layout, number
        worlds = self._made.pop(key, None)
        if worlds is None:
            worlds = self._make_worlds(states)
        else:
            for i, state in enumerate(states):
                worlds.reset(i, state)
        self._made[key] = worlds  # last
        if len(self._made) > 2 * self.num_envs:  # simulations take tens of megabytes each
            del self._made[next(iter(self._made))]
        return worlds


Drawn = list[tuple[Indices, list[Initiation]]]  # environments, and the states that they begin in


class _Starts(Protocol):
    """Draws the states in which all environments begin their next episodes."""

    def draw(self, rng: np.random.Generator) -> Drawn:
        """States for environments that have the same objects.

        Args:
            rng: Generator that draws them.
        """
        ...


def _starts(initiations: Sequence[Initiation], num_envs: int) -> _Starts:
    pools = _pools(initiations)
    return _AnyStarts(initiations, num_envs) if len(pools) > num_envs else _Pools(pools, num_envs)


class _Pools:
    """Each pool, of states over the same objects, has environments of its own."""

    def __init__(self, pools: Sequence[Sequence[Initiation]], num_envs: int) -> None:
        shares = proportional_shares([len(pool) for pool in pools], num_envs)
        used = [(pool, share) for pool, share in zip(pools, shares, strict=True) if share]
        bounds = np.cumsum([share for _, share in used])[:-1]
        self._pools = [pool for pool, _ in used]
        self._parts = np.split(np.arange(num_envs), bounds)

    def draw(self, rng: np.random.Generator) -> Drawn:
        return [
            (part, [pool[int(rng.integers(len(pool)))] for _ in part])
            for pool, part in zip(self._pools, self._parts, strict=True)
        ]


class _AnyStarts:
    """Every environment begins anywhere: there are fewer environments than pools.

    With environments of their own, most pools would have none, and nothing would be learned there.
    """

    def __init__(self, initiations: Sequence[Initiation], num_envs: int) -> None:
        self._initiations, self._num_envs = initiations, num_envs

    def draw(self, rng: np.random.Generator) -> Drawn:
        drawn = rng.choice(len(self._initiations), self._num_envs, replace=False)
        return [(np.array([env]), [self._initiations[i]]) for env, i in enumerate(drawn)]


def _pools(initiations: Sequence[Initiation]) -> list[list[Initiation]]:
    """Initiations grouped by the objects that there are."""
    pools: dict[Layout, list[Initiation]] = {}
    for initiation in initiations:
        pools.setdefault(initiation.state.layout, []).append(initiation)
    return list(pools.values())
