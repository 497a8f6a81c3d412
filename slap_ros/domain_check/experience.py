# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States and actions to check a domain with: from plans, and from random actions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slap_ros.core import Action, ActionSpace, Domain
from slap_ros.planning.execution import EpisodeResult
from slap_ros.relational import State

HOLD = 5  # environment steps for which a random action is repeated, so that it gets somewhere


@dataclass(frozen=True)
class Transition:
    """What a world did once, while it ran on without a reset."""

    state: State
    action: Action
    following: State

    @property
    def objects_key(self) -> int:
        """Equal for states of the same objects, whose worlds can be reset to each other."""
        return id(self.state.layout)


@dataclass(frozen=True)
class Experience:
    """Transitions, each of them seen once."""

    transitions: tuple[Transition, ...]

    @property
    def states(self) -> list[State]:
        """Every state, in the order of the transitions."""
        return [transition.state for transition in self.transitions]


def gather(
    domain: Domain,
    start: State,
    episodes: Sequence[EpisodeResult],
    count: int,
    rng: np.random.Generator,
) -> Experience:
    """Transitions, half of them from executed plans, half from random actions.

    Args:
        domain: Domain whose world is stepped.
        start: State in which random actions begin if no plan was executed.
        episodes: Episodes of executed plans.
        count: Number of transitions.
        rng: Source of random numbers: it chooses among the plans' transitions, and random actions.

    Returns:
        As many transitions.
    """
    planned = [
        Transition(*step)
        for episode in episodes
        for step in zip(episode.states, episode.actions, episode.states[1:], strict=False)
    ]
    chosen = rng.permutation(len(planned))[: count // 2]
    from_plans = [planned[i] for i in chosen]
    starts = [transition.state for transition in from_plans] or [start]
    at_random = []
    wanted = count - len(from_plans)
    for i in range(math.ceil(wanted / (2 * HOLD))):
        at_random += _wander(domain, starts[i % len(starts)], 2 * HOLD, rng)
    return Experience((*from_plans, *at_random[:wanted]))


def _wander(domain: Domain, start: State, steps: int, rng: np.random.Generator) -> list[Transition]:
    """Random actions from a state on, without a reset in between."""
    world = domain.make_world(start)
    found, state, action = [], world.state, np.zeros(0)
    for step in range(steps):
        if step % HOLD == 0:
            action = random_action(domain.learned_actions, rng)
        following = world.step(action)
        found.append(Transition(state, action, following))
        state = following
    return found


def random_action(actions: ActionSpace, rng: np.random.Generator) -> Action:
    """An action drawn uniformly from the action space, shape (axes,)."""
    return rng.uniform(actions.low, actions.high)
