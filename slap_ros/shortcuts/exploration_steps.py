# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many environment steps exploration takes: from a state at most, and in all as a rule."""

from __future__ import annotations

from math import ceil

from slap_ros.core import Domain
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import State
from slap_ros.shortcuts.approaches import USUAL_STEPS, sides_of
from slap_ros.shortcuts.exploration_policies import PROBE_STEPS, within_reach
from slap_ros.shortcuts.exploration_settings import ExplorationSettings

UNBATCHED_WORLDS = 4  # worlds where a domain's cannot be stepped together


def exploration_worlds(domain: Domain, settings: ExplorationSettings) -> int:
    """The number of worlds in which rollouts are made at once.

    Args:
        domain: Domain of the worlds.
        settings: Settings of exploration.
    """
    return settings.rollouts if domain.steps_together else UNBATCHED_WORLDS


def most_rollout_steps(domain: Domain, settings: ExplorationSettings, state: State) -> int:
    """Count the environment steps of all rollouts from a state.

    Args:
        domain: Domain of the state.
        settings: Settings of exploration.
        state: State in which the rollouts begin.

    Returns:
        Environment steps where no rollout fails early.
    """
    worlds = exploration_worlds(domain, settings)
    batches = ceil(settings.rollouts / worlds) * (2 if settings.also_repeat else 1)
    aiming = 0
    if settings.pushes:
        batches += settings.pushes * len(within_reach(domain, state))
        axes = ActionMap(domain, gripper=False).size
        aiming = settings.pushes * 2 * axes * PROBE_STEPS  # forwards and backwards along each
    return batches * worlds * settings.length + aiming


def usual_approach_steps(domain: Domain, settings: ExplorationSettings, state: State) -> int:
    """Estimate the environment steps of all approaches from a state, and of what follows them.

    Args:
        domain: Domain of the state.
        settings: Settings of exploration.
        state: State in which the approaches begin.

    Returns:
        Environment steps where every approach arrives.
    """
    if not settings.approaches:
        return 0
    pushes = settings.approaches * exploration_worlds(domain, settings) * settings.length
    reach = within_reach(domain, state)
    return sum(len(sides_of(domain, state, obj)) for obj in reach) * (USUAL_STEPS + pushes)


def usual_steps(domain: Domain, settings: ExplorationSettings, skill_steps: int) -> int:
    """Estimate how many environment steps exploration takes.

    Those of the rollouts are counted, which are most of them. Exploration may take fewer, where
    rollouts fail early, approaches do not arrive, or what is held changes inside a skill, and more:
    skills are executed, too, to reach states and to see what it takes on from them.

    Args:
        domain: Domain that is explored.
        settings: Settings of exploration.
        skill_steps: Environment steps that a skill usually takes.

    Returns:
        Environment steps in all tasks together.
    """
    sources = settings.nodes
    if settings.inside:  # each node but the first is reached by a skill
        sources += (settings.nodes - 1) * ((skill_steps - 1) // settings.inside)
    state = domain.task(0).initial_state
    each = most_rollout_steps(domain, settings, state)
    near = usual_approach_steps(domain, settings, state)
    return settings.tasks * (sources * each + settings.nodes * near)
