# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a state is Markov: reset to it and step, and the same comes of it, bit for bit.

Planning, learning, execution and replay rest on this (a reset world must go on as if it had
never been reset).
"""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain, World
from slap_ros.doctor.check import Check
from slap_ros.domain_check.experience import Experience
from slap_ros.relational import State

ADVICE = (
    "put what is missing into the state, or use RebuildEachStep (docs/new-domain.md); look for "
    "warm starts, caches and velocities that a reset does not set"
)


def reset(domain: Domain, experience: Experience) -> Check:
    """Whether a world that is reset to a state is in that state, to the bit."""
    worlds: dict[int, World] = {}
    for transition in experience.transitions:
        state = transition.state
        world = worlds.setdefault(transition.objects_key, domain.make_world(state))
        world.reset(state)
        if difference := differing(state, world.state):
            return Check("reset", "problem", f"after a reset, {difference}", ADVICE)
    return Check("reset", "ok", f"{len(experience.transitions)} states, exactly")


def repeat(domain: Domain, experience: Experience, rng: np.random.Generator) -> Check:
    """Whether each transition gives the same state again, from a reset, in random order.

    Args:
        domain: Domain of the worlds. There is one world for each set of objects, so that each reset
            follows a step from another state.
        experience: Transitions of worlds that ran on.
        rng: Source of random numbers for the order.

    Returns:
        The finding, with the first and the largest difference.
    """
    worlds: dict[int, World] = {}
    first, different = "", 0
    for i in rng.permutation(len(experience.transitions)):
        transition = experience.transitions[i]
        world = worlds.setdefault(transition.objects_key, domain.make_world(transition.state))
        world.reset(transition.state)
        if difference := differing(transition.following, world.step(transition.action)):
            different += 1
            first = first or difference
    total = len(experience.transitions)
    if different:
        found = f"{different} of {total} steps come out differently from a reset; first, {first}"
        return Check("Markov", "problem", found, ADVICE)
    return Check("Markov", "ok", f"{total} steps from a reset in random order, to the bit")


def differing(wanted: State, found: State) -> str:
    """Which feature differs most, in words; empty where the states are the same to the bit."""
    if wanted.key == found.key:
        return ""
    for obj in wanted.layout.objects:
        distances = np.abs(found[obj] - wanted[obj])
        if distances.any():
            i = int(distances.argmax())
            feature = obj.type.features[i]
            return (
                f"{obj.name}.{feature.name} is {found[obj][i]} instead of {wanted[obj][i]} "
                f"(off by {distances[i]:.2g} {feature.unit})"
            )
    return "the signs of zeros or the objects differ"
