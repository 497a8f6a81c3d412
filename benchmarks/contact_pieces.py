# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What happens without each piece of the contact step: ``python -m benchmarks.contact_pieces``.

Each piece is taken away alone, and what it is there for is measured with it and without it.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from benchmarks import contact_skills
from benchmarks.contact_skills import grasped_world, grasps, in_hand
from benchmarks.printing import show
from benchmarks.workbench import (
    BENCH,
    HANDLE_AT,
    LOOSE,
    Move,
    Setting,
    action_towards,
    start,
    value,
)
from slap_ros.geometry.pose import rotate
from slap_ros.worlds.contact import dynamics, simulation
from slap_ros.worlds.contact.contacts import Side
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.hand_model import QUICK
from slap_ros.worlds.contact.simulation import SIMULATIONS
from slap_ros.worlds.contact.world import ContactWorld

COUNT = 20  # grasps of each
STEPS = 500
Figures = dict[str, float]


@contextmanager
def without(owner: Any, name: str, instead: Any) -> Iterator[None]:
    """Run with everything as it is but for one piece, in simulations of its own."""
    was = getattr(owner, name)
    SIMULATIONS.forget()
    setattr(owner, name, instead)
    try:
        yield
    finally:
        setattr(owner, name, was)
        SIMULATIONS.forget()


def impure() -> Figures:
    """The share of steps that come out differently when replayed in another order."""
    x, y, z = HANDLE_AT
    moves = [
        Move((x, y, z), 8, yaw=0.5 * math.pi),
        Move((x, y, z), 6, close=True, yaw=0.5 * math.pi),
        Move((x - 0.1, y, z), 20, close=True, yaw=0.5 * math.pi, fastest=0.008),
        Move((0.45, 0.1, 0.1), 20, yaw=0.0),
        Move((0.45, 0.1, 0.02), 8),
        Move((0.45, 0.1, 0.02), 6, close=True),
        Move((0.5, -0.12, 0.05), 20, close=True),
        Move((0.5, -0.12, 0.02), 12),
    ]
    steps = []
    begin = start(Setting(hand=hand_at((x, y, 0.14), 0.5 * math.pi)))
    with ContactWorld(BENCH, begin) as world:
        for move in moves:
            for _ in range(move.steps):
                before, action = world.state, action_towards(world.state, move)
                steps.append((before, action, world.step(action)))
    different = 0
    with ContactWorld(BENCH, begin) as world:
        for i in np.random.default_rng(0).permutation(len(steps)):
            before, action, after = steps[i]
            world.reset(before)
            different += world.step(action) != after
    return {"steps_that_differ_percent": 100.0 * different / len(steps)}


def droop() -> Figures:
    """How far a rod that is held off its middle hangs down, degrees."""
    angles = []
    for seed in range(COUNT):
        with grasped_world("rod", seed) as world:
            if value(world.state, "rod", "held") > 0.5:
                axis = rotate(in_hand(world.state, "rod").quaternion, (0.0, 0.0, 1.0))
                angles.append(math.degrees(math.asin(min(1.0, abs(axis[2])))))
    return {"held": len(angles), "droop_median_deg": float(np.median(angles))}


def rolling() -> Figures:
    """The speed of a rod that was set rolling with 0.1 m/s, after 3 s."""
    with ContactWorld(LOOSE, start(Setting(hand=hand_at((0.45, 0.3, 0.3))), LOOSE)) as world:
        rod = world.state.layout.object("rod")
        # Towards where there is room.
        world.reset(world.state.replace({(rod, "vy"): -0.1, (rod, "wx"): 0.1 / 0.012}))
        for _ in range(50):
            state = world.step(np.zeros(5))
    return {"after_2.5_s_m_per_s": abs(value(state, "rod", "vy"))}


def drift() -> Figures:
    """How far a cube moves in 500 steps in which nobody touches it, m."""
    near = Setting(hand=hand_at((0.45, 0.1, 0.09)))
    with ContactWorld(BENCH, start(near)) as world:
        begin = world.state
        cube = begin.layout.object("cube")
        for _ in range(STEPS):
            state = world.step(np.zeros(5))
        seconds = process_time()
        for _ in range(100):
            world.step(np.zeros(5))
        seconds = process_time() - seconds
    way = math.dist(state[cube][:3].tolist(), begin[cube][:3].tolist())
    return {"drift_mm": 1e3 * way, "steps_per_s": 100 / seconds}


def pressing() -> Figures:
    """How deep the fingers are in a cube that they hold, mm, and what is held of 20 grasps."""
    deepest = 0.0
    for seed in range(4):
        with grasped_world("cube", seed) as world:
            deepest = min([deepest, *(point.distance for point in world.contacts)])
    held = grasps("cube", COUNT)
    return {"deepest_mm": -1e3 * deepest, "held_percent": held["held_percent"]}


def press() -> Figures:
    """The force on the table when the hand is pulled down as hard as it can be, N."""
    with ContactWorld(LOOSE, start(Setting(hand=hand_at((0.45, -0.02, 0.02))), LOOSE)) as world:
        for _ in range(20):
            world.step(np.array([0.0, 0.0, -0.02, 0.0, 0.0]))
        fingers = {Side.LEFT_FINGER, Side.RIGHT_FINGER}
        force = sum(p.force_n for p in world.contacts if {p.first.side, p.second.side} & fingers)
    return {"pressed_n": force}


def pieces() -> dict[str, tuple[Callable[[], Figures], tuple[Any, str, Any]]]:
    """The function that measures each piece, and what stands in for the piece."""
    contact = simulation.ContactSimulation
    return {
        "prime": (impure, (contact, "_prime", lambda *_: None)),
        "rest mark": (drift, (dynamics, "REST_SPEED", 0.0)),
        "forces per substep": (pressing, (simulation, "MOTOR_SUBSTEPS", 1)),
        "slow fingers": (pressing, (contact_skills, "HAND", replace(QUICK, finger_speed=2.0))),
        "coupled fingers": (pressing, (simulation, "COUPLING_N", 0.0)),
        "spinning friction": (droop, (simulation, "FINGER_SPINNING", 0.0)),
        "rolling friction": (rolling, (simulation, "ROLLING", 0.0)),
        "weight cancelled": (press, (simulation, "LIFT", (0.0, 0.0, 0.0))),
    }


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows: dict[str, Figures] = {}
    for name, (measure, taken) in pieces().items():
        rows[name] = measure()
        with without(*taken):
            rows[f"without {name}"] = measure()
    show(rows, arguments.json)


if __name__ == "__main__":
    main()
