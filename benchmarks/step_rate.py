# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How fast worlds step: ``python -m benchmarks.step_rate DOMAIN [--json]``.

Obstacle 2D: many worlds in one numpy batch against one world at a time, the same arithmetic.
Obstacle Tower: the physics step against plain stepping (``benchmarks.physics_step``), random
actions from home (away) and an arm kept in the tower (contact).
Cluttered Drawer: the same, with atoms, against plain stepping without; the contact is that of an
open hand around the target block that moves at random.
Cleanup Table: world and atoms against plain stepping alone, random actions from home.
All: the atoms of a state that was not seen before.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from benchmarks.printing import show
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import step
from slap_ros.relational import State
from slap_ros.worlds.panda import MAX_STEP

BATCH = 20_000  # worlds
ROUNDS = 30
SINGLE_STEPS = 3_000
EPISODE = 50  # steps
TURNS = 3  # of plain stepping and ours, as others share the machine


def obstacle2d() -> dict[str, Any]:
    """Steps a second, batched and one by one."""
    domain = get_domain("obstacle2d")
    initial = domain.task(0).initial_state
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (ROUNDS, BATCH, 3)) * [0.1, 0.1, 1.0]

    data = np.repeat(initial.data[None], BATCH, axis=0)
    start = process_time()
    for action in actions:
        data = step(initial.layout, data, action)
    batch = ROUNDS * BATCH / (process_time() - start)

    world = domain.make_world(initial)
    start = process_time()
    for action in actions[0, :SINGLE_STEPS]:
        world.step(action)
    single = SINGLE_STEPS / (process_time() - start)
    return {
        "batch_steps_per_s": batch,
        "single_steps_per_s": single,
        "ratio": batch / single,
        "atoms_us": atoms_us(domain),
    }


def obstacle_tower() -> dict[str, Any]:
    """Ratios to plain stepping, steps a second, and with atoms."""
    from benchmarks.physics_step import speed

    domain, figures = get_domain("obstacle_tower"), speed()
    return {
        "away": {
            "ratio": figures["away_ratio"],
            "steps_per_s": figures["away_steps_per_s"],
            "with_atoms_steps_per_s": with_atoms(domain),
        },
        "contact": {
            "ratio": figures["contact_ratio"],
            "steps_per_s": figures["contact_steps_per_s"],
        },
        "atoms_us": atoms_us(domain),
    }


def cleanup_table() -> dict[str, Any]:
    """Compare world and atoms with a plain world without atoms."""
    from benchmarks.physics_step import Plain, away, steps_per_second
    from slap_ros.domains.cleanup_table.scene import scene_of
    from slap_ros.domains.cleanup_table.shapes import shipped

    domain = get_domain("cleanup_table")
    initial = get_domain("cleanup_table", "paper").task(0).initial_state
    plain = Plain(scene_of(initial, shipped()), initial)
    rates = [(steps_per_second(plain, away()), with_atoms(domain)) for _ in range(TURNS)]
    return {
        "plain_steps_per_s": max(rate for rate, _ in rates),
        "with_atoms_steps_per_s": max(rate for _, rate in rates),
        "ratio": median(ours / theirs for theirs, ours in rates),
        "atoms_us": atoms_us(domain),
    }


def cluttered_drawer() -> dict[str, Any]:
    """Ratios to plain stepping, steps a second, both with atoms."""
    from benchmarks.physics_step import EPISODES, Episode, Plain, steps_per_second, with_joints
    from slap_ros.domains.cluttered_drawer.scene import scene_of
    from slap_ros.domains.tabletop.grasps import from_above
    from slap_ros.domains.tabletop.state_access import joints_of
    from slap_ros.motion import nearest_configurations
    from slap_ros.worlds.features import pose_of

    domain = get_domain("cluttered_drawer", "paper")
    initial = domain.task(0).initial_state
    target = pose_of(initial, initial.layout.object("block1")).position
    between = from_above(target, math.pi / 4)  # the fingers, in the gaps between blockers
    (around,) = nearest_configurations([between], joints_of(initial))
    assert around is not None
    figures: dict[str, Any] = {}
    for name, joints in (("away", joints_of(initial)), ("contact", around)):
        start, rng = with_joints(initial, joints), np.random.default_rng(0)
        high = np.array([*MAX_STEP, 0.0])
        episodes = [
            Episode(joints, rng.uniform(-high, high, (EPISODE, 8))) for _ in range(EPISODES)
        ]
        plain = steps_per_second(Plain(scene_of(initial), initial), episodes)
        ours = with_atoms(domain, start)
        figures[name] = {"ratio": ours / plain, "with_atoms_steps_per_s": ours}
    return {**figures, "atoms_us": atoms_us(domain)}


def with_atoms(domain: Domain, initial: State | None = None) -> float:
    """Steps a second of world and perception, random actions, by default from a task's start."""
    initial = initial or get_domain(domain.name, "paper").task(0).initial_state
    space, world = domain.atom_space(initial), domain.make_world(initial)
    rng = np.random.default_rng(0)
    learned = domain.learned_actions
    high = learned.join(learned.split(np.array(learned.high))[0], 0.0)  # the gripper rests
    seconds = 0.0
    for _ in range(SINGLE_STEPS // EPISODE):
        world.reset(initial)
        actions = rng.uniform(-high, high, (EPISODE, len(high)))
        start = process_time()
        for action in actions:
            space.abstract(world.step(action))
        seconds += process_time() - start
    return SINGLE_STEPS / seconds


def atoms_us(domain: Domain) -> float:
    """Microseconds for the atoms of a state, each state a new one."""
    initial = get_domain(domain.name, "paper").task(0).initial_state
    space = domain.atom_space(initial)
    noise = np.random.default_rng(0).normal(0, 1e-6, (500, initial.layout.size))
    states = [State(initial.layout, row) for row in initial.data + noise]
    start = process_time()
    for state in states:
        space.abstract(state)
    return (process_time() - start) / len(states) * 1e6


BENCHMARKS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "obstacle2d": obstacle2d,
    "obstacle_tower": obstacle_tower,
    "cluttered_drawer": cluttered_drawer,
    "cleanup_table": cleanup_table,
}


def main() -> None:
    """Measure and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain", choices=list(BENCHMARKS))
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = BENCHMARKS[arguments.domain]()
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
