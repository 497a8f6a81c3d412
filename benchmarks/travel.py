# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the arm takes at least, on which proofs rely: ``python -m benchmarks.travel [--sweep N]``.

Control steps of the shortest approach from above a goal, and of the shortest way there and down
from where the hand pointed down TRAVEL away, at any height: over the table, all branches of the
inverse kinematics and all of its redundancy. Joint 7 does not count, so that it is for any yaw.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.printing import show
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.domains.tabletop.skills import TRAVEL
from slap_ros.domains.tabletop.transit import CLEARANCE
from slap_ros.motion import Joints, linear_motion, path_steps, shifted
from slap_ros.motion.inverse_kinematics import ik_solutions
from slap_ros.motion.joints import HIGH, LOW, STEP, Array
from slap_ros.worlds.panda import grasp_pose

REACHES = np.arange(0.28, 0.8, 0.04)  # m, from the base
HEIGHTS = (0.1, 0.2, 0.3, 0.4)  # m
RISES = (-0.1, -0.05, 0.0, 0.02, 0.035, 0.05, 0.065, 0.08, 0.1, 0.15)  # m, of the start over a goal
TURNS = np.linspace(0.0, math.pi, 9)  # rad, around the goal; the other side is alike
YAWS = (0.0, 1.5)  # rad, from which joint 7 turns the wrist all around
GOALS = [(float(reach), 0.0, height) for reach in REACHES for height in HEIGHTS]  # m


def configurations(place: tuple[float, float, float], sweep: int) -> Joints:
    """Configurations with the hand pointing down at a place, rad, shape (n, 7)."""
    joint7 = np.linspace(LOW[6], HIGH[6], sweep)
    return np.concatenate([ik_solutions(from_above(place, yaw), joint7) for yaw in YAWS])


def approaches(goal: tuple[float, float, float], sweep: int) -> tuple[Joints, Array]:
    """Configurations over a goal, and the control steps down from each, shapes (n, 7) and (n,)."""
    x, y, z = goal
    over, steps = [np.empty((0, 7))], []
    for q in configurations((x, y, z + CLEARANCE), sweep):
        way = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, -CLEARANCE)))
        if way is not None:
            over.append(q[None])
            steps.append(path_steps(way))
    return np.concatenate(over), np.array(steps)


def travels(goal: tuple[float, float, float], sweep: int) -> Iterator[tuple[float, float]]:
    """Control steps down to a goal, and of the whole way there: the least from each start."""
    x, y, z = goal
    over, down = approaches(goal, sweep)
    for rise in RISES:
        for turn in TURNS:
            start = (x + TRAVEL * math.cos(turn), y + TRAVEL * math.sin(turn), z + rise)
            starts = configurations(start, sweep)
            if len(starts) and len(over):
                apart = np.abs(starts[:, None, :6] - over[None, :, :6]) / STEP[:6]
                yield float(down.min()), float((apart.max(axis=-1) + down).min())


def measure(sweep: int, goals: Sequence[tuple[float, float, float]]) -> dict[str, float]:
    """The least of all goals.

    Args:
        sweep: Number of values of joint 7.
        goals: Places of the grasp point, m.
    """
    found = [one for goal in goals for one in travels(goal, sweep)]
    return {"approach": min(a for a, _ in found), "travel": min(t for _, t in found)}


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sweep", type=int, default=96)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    show(measure(arguments.sweep, GOALS), arguments.json)


if __name__ == "__main__":
    main()
