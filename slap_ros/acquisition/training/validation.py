# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The success of a policy from given states, and whether constant actions do as well.

Success is that of a stage of a plan: everything that is expected holds in some step of the horizon,
and nothing that the operator deletes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.acquisition.training.skill_env import Initiation, SkillMdp
from slap_ros.core import Domain, World
from slap_ros.relational import Layout, State
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import Groundings
from slap_ros.skills.reward import SkillReward

SIDE_BY_SIDE = 8  # number of trials that a policy acts in together
RANDOM = "random"  # name of the policy of random actions
RANDOM_ROUNDS = 5  # random trials from each state, so that 30 or 40 states do not decide by chance
# A function from observations, shape (n, size), to actions, shape (n, actions).
Act = Callable[[NDArray[np.float32]], Array | NDArray[np.float32]]


@dataclass(frozen=True)
class Vacuity:
    """The success of the best blind policy, which observes nothing.

    Args:
        success: Share of the trials in which the blind policy succeeds.
        policy: Name of the blind policy; empty where none succeeds.
        trials: Number of trials: one per state, ``RANDOM_ROUNDS`` of random actions; 0 where none
            succeeds.
    """

    success: float
    policy: str = ""
    trials: int = 0


class SkillTrials:
    """Trials of one skill from given states, each the same for whatever policy."""

    def __init__(
        self,
        domain: Domain,
        reward: SkillReward,
        initiations: Sequence[Initiation],
        horizon: int,
    ) -> None:
        """Prepare the trials.

        Args:
            domain: Domain of the worlds.
            reward: Reward of the skill.
            initiations: Initiation states, one for each trial.
            horizon: Environment steps of each trial.
        """
        self._domain, self._initiations, self._horizon = domain, initiations, horizon
        groundings = list(dict.fromkeys(one.grounding for one in initiations))
        self._mdp = SkillMdp(domain, reward, Groundings(groundings))

    def success(self, act: Act) -> float:
        """Share of trials in which a policy succeeds."""
        return float(np.mean([done for _, done in self.results(act)]))

    def results(self, act: Act) -> Iterator[tuple[int, bool]]:
        """Whether a policy succeeds, for the number of each trial."""
        by_layout: dict[Layout, list[int]] = {}
        for number, initiation in enumerate(self._initiations):
            by_layout.setdefault(initiation.state.layout, []).append(number)
        for numbers in by_layout.values():
            worlds: list[World] = []  # reset to the states that come next
            for i in range(0, len(numbers), SIDE_BY_SIDE):
                some = numbers[i : i + SIDE_BY_SIDE]
                yield from zip(some, self._run(some, act, worlds), strict=True)

    def vacuity(self, rng: np.random.Generator) -> Vacuity:
        """Find the best policy of constant or random actions.

        Random actions are other ones in every round; constant ones would do the same again.
        """
        best = Vacuity(0.0)
        for name, act in blind_policies(self._mdp.action_map.size, rng).items():
            rounds = RANDOM_ROUNDS if name == RANDOM else 1
            success = float(np.mean([self.success(act) for _ in range(rounds)]))
            if success > best.success:
                best = Vacuity(success, name, rounds * len(self._initiations))
        return best

    def _run(self, numbers: Sequence[int], act: Act, known: list[World]) -> list[bool]:
        """Run trials over the same objects side by side, each until it succeeds.

        Args:
            numbers: Numbers of the trials.
            act: Policy that acts in them.
            known: Worlds of earlier trials over these objects; new ones are added.
        """
        begun = [self._initiations[i] for i in numbers]
        which = np.array([self._mdp.groundings.number(one.grounding) for one in begun])
        worlds = self._worlds_in([one.state for one in begun], known)
        states = np.stack([world.state.data for world in worlds])
        rows = first = self._mdp.groundings.rows(states.copy())
        going = np.arange(len(begun))
        for _ in range(self._horizon):
            # All of them act: what random actions are drawn must not depend on who succeeds.
            actions = self._mdp.action_map(act(self._mdp.observe(rows, which)).astype(np.float64))
            for i in going:
                states[i] = worlds[i].step(actions[i]).data
            rows = self._mdp.groundings.rows(states)
            _, done = self._mdp.rewards(rows[going], which[going], first[going])
            going = going[~done]
            if not going.size:
                break
        return [i not in going for i in range(len(begun))]

    def _worlds_in(self, states: Sequence[State], known: list[World]) -> list[World]:
        """Worlds in states over the same objects: known ones, reset, and new ones, which are added.

        Args:
            states: States of the worlds.
            known: Worlds over these objects.
        """
        for world, state in zip(known, states, strict=False):
            world.reset(state)
        known += [self._domain.make_world(state) for state in states[len(known) :]]
        return known[: len(states)]


def blind_policies(actions: int, rng: np.random.Generator) -> Mapping[str, Act]:
    """Policies that see nothing: every action's extremes, nothing at all, and random actions.

    Args:
        actions: Number of the policy's actions.
        rng: Generator that draws the random actions.
    """

    def constant(action: Array) -> Act:
        return lambda observations: np.tile(action, (len(observations), 1))

    def random(observations: NDArray[np.float32]) -> Array:
        return rng.uniform(-1.0, 1.0, (len(observations), actions))

    policies: dict[str, Act] = {"nothing": constant(np.zeros(actions)), RANDOM: random}
    for i in range(actions):
        for sign in (-1.0, 1.0):
            extreme = np.zeros(actions)
            extreme[i] = sign
            policies[f"action {i} at {sign:+.0f}"] = constant(extreme)
    return policies
