# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States of domains with drawers, changed by hand, and what is looked for in all of them."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain, Policy, World
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Column, Object, State
from slap_ros.worlds.features import POSE_NAMES
from support.skill_starts import CONSTANT, achieves


def atoms(domain: Domain, state: State) -> set[str]:
    """What holds."""
    space = domain.atom_space(state)
    return {str(atom) for atom in space.decode(space.abstract(state))}


def put(state: State, name: str, pose: Pose) -> State:
    """The state with a body elsewhere."""
    obj, values = state.layout.object(name), (*pose.position, *pose.quaternion)
    return state.replace({(obj, axis): v for axis, v in zip(POSE_NAMES, values, strict=True)})


def carry_out(world: World, policy: Policy) -> State:
    """Follow a policy to its end."""
    while (action := policy(world.state)) is not None:
        world.step(action)
    return world.state


def constant_motions(
    domain: Domain, state: State, plan: tuple[tuple[str, tuple[str, ...]], ...]
) -> dict[tuple[str, str], bool]:
    """Whether each constant motion does what an operator says, from where its skill begins.

    Args:
        domain: With scripts, which lead from one start to the next.
        state: In which the first operator begins.
        plan: Names of operators and of their objects.
    """
    acquisition, found = domain.acquisition, {}
    operators = {operator.name: operator for operator in acquisition.operators}
    with domain.make_world(state) as world:
        for name, objects in plan:
            chosen: tuple[Object, ...] = tuple(map(state.layout.object, objects))
            before = world.state
            start = carry_out(world, acquisition.approach(before, chosen))
            for motion, action in CONSTANT.items():
                found[name, motion] = achieves(domain, operators[name], chosen, start, action)
            world.reset(before)
            carry_out(world, acquisition.scripts[name](before, chosen))
    return found


def assert_margins_agree(domain: Domain, batch: State) -> None:
    """Every atom holds in some of the states and not in others, and its margin says the same."""
    space = domain.atom_space(State(batch.layout, batch.data[0]))
    truth = space.truth(batch)
    for i, atom in enumerate(space.atoms):
        assert 0.01 < truth[:, i].mean() < 0.99, atom
        margins = atom.predicate.margin(batch, *(Column((obj,)) for obj in atom.objects))
        assert ((margins[..., 0] >= 0.0) == truth[:, i]).all(), atom


def assert_metrics_agree(domain: Domain, batch: State) -> None:
    """A metric's definitions for one state and for many give the same."""
    objects = {kind: batch.layout.of_type(kind) for kind in domain.types}
    for metric in domain.metrics:
        chosen = [objects[kind][-1] for kind in metric.types]
        many = metric.value(batch, *(Column((obj,)) for obj in chosen))[..., 0]
        one = [metric.scalar(State(batch.layout, row), *chosen) for row in batch.data]
        assert np.allclose(many, one, rtol=0.0, atol=1e-9), metric
