# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States changed by hand, what holds in them, and whether tasks begin in such as can be."""

from collections.abc import Callable, Iterable

import numpy as np

from slap_ros.core import Domain
from slap_ros.relational import Layout, Object, State


def changed(state: State, name: str, **features: float) -> State:
    """The state with other features of an object."""
    obj = state.layout.object(name)
    return state.replace({(obj, feature): value for feature, value in features.items()})


def fluent_atoms(state: State, domain: Domain) -> set[str]:
    """The atoms that hold and that operators may change, as text."""
    space = domain.atom_space(state)
    return {str(atom) for atom in space.decode(space.abstract(state) & ~space.static)}


def initial_states_at_rest(
    domain: Domain, resting: Callable[[Layout], Iterable[Object]]
) -> list[State]:
    """States in which a hundred tasks begin: all differ, and the world refuses none.

    Args:
        domain: Domain of the tasks.
        resting: Objects that stay as they are, to the bit, while nothing is commanded.
    """
    states = [domain.task(seed).initial_state for seed in range(100)]
    assert len({state.key for state in states}) == 100
    with domain.make_world(states[0]) as world:
        for state in states:
            world.reset(state)
            rested = world.step(np.zeros(len(domain.action_space.axes)))
            for obj in resting(state.layout):
                assert rested[obj].tobytes() == state[obj].tobytes()
    return states
