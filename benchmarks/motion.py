# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion around a tower of three blocks: ``python -m benchmarks.motion [--queries N] [--json]``.

Lengths are control steps; ``straight`` is the bound that the joint limits set, obstacles or not,
and ``ten a piece`` the timing of the preset ``paper`` on the same paths. Then each compiled kernel
beside numpy on the same input, called from Python: microseconds of both, and the ratio.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import NamedTuple

import numpy as np

from benchmarks.printing import show
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.motion import (
    CollisionChecker,
    Joints,
    MotionPlanningError,
    control_steps,
    inverse_kinematics,
    linear_motion,
    plan_path,
    retime,
    retime_fixed_steps,
    shifted,
)
from slap_ros.motion.backend import Backend, backend
from slap_ros.motion.joints import RESOLUTION
from slap_ros.motion.kinematics import matrix
from slap_ros.motion.numpy_backend import NumpyBackend
from slap_ros.motion.planning import MAX_SAMPLES, SHORTENING_TRIES
from slap_ros.worlds.panda import HOME, JOINT_HIGH, JOINT_LOW, Pose, grasp_pose

HALF = (0.025, 0.025, 0.025)  # m, of a block
TABLE = OrientedBox(Pose((0.5, 0.0, -0.175)), (0.25, 0.4, 0.25))
ON_TABLE = 0.1  # m, the height of a block's centre
APPROACH = 0.05  # m
LIFT = 0.005  # m, of a held block over the table where its carriage ends
START = np.array(HOME)

Figures = dict[str, dict[str, float]]


class Scene(NamedTuple):
    """A tower and where a block is taken from and carried to, past the tower."""

    tower: list[OrientedBox]
    block: OrientedBox
    place: tuple[float, float]  # m


def block(x: float, y: float, z: float = ON_TABLE) -> OrientedBox:
    """A block.

    Args:
        x: X of the block's centre, m.
        y: Y of the block's centre, m.
        z: Z of the block's centre, m.
    """
    return OrientedBox(Pose((x, y, z)), HALF)


def top_down(x: float, y: float, z: float, yaw: float = 0.0) -> Pose:
    """A grasp from above.

    Args:
        x: X of the grasp point, m.
        y: Y of the grasp point, m.
        z: Z of the grasp point, m.
        yaw: Yaw of the hand, rad.
    """
    return Pose((x, y, z), (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0))


def scenes(count: int) -> Iterator[Scene]:
    """Towers with a block on one side and its place on the other."""
    rng = np.random.default_rng(0)
    while count:
        tower = rng.uniform((0.42, -0.12), (0.58, 0.12))
        offset = rng.uniform((-0.08, 0.13), (0.08, 0.2)) * rng.choice((-1.0, 1.0))
        (x, y), (px, py) = (tower + offset).tolist(), (tower - offset).tolist()
        foot_x, foot_y = tower.tolist()
        blocks = [block(foot_x, foot_y, ON_TABLE + 0.05 * i) for i in range(3)]
        yield Scene(blocks, block(x, y), (px, py))
        count -= 1


def scenes_of_kernels() -> tuple[CollisionChecker, Joints, Joints]:
    """A held block between two towers: the checker, and both ends of a motion that needs a tree."""
    towers = [block(0.45, y, ON_TABLE + 0.05 * i) for y in (0.0, 0.1) for i in range(3)]
    free = CollisionChecker([TABLE, *towers], held=OrientedBox(Pose(), HALF))
    middle = np.array((0.0, -0.2, 0.0, -1.9, 0.0, 1.6, 0.8))
    turn = np.eye(len(middle))[0]
    return free, middle - 0.5 * turn, middle + 0.6 * turn


def measure_kernels(backend: Backend) -> dict[str, float]:
    """Microseconds of each of a backend's answers, called from Python.

    Args:
        backend: Compiled code or numpy.
    """
    checker, start, goal = scenes_of_kernels()
    space = backend.free_space(checker.scene)
    poses = [top_down(0.5, 0.2, 0.2, yaw) for yaw in np.linspace(-1.5, 1.5, 4).tolist()]
    targets = np.array([matrix(pose) for pose in poses])
    lift = shifted(grasp_pose(start), (0.0, 0.0, APPROACH))
    tree = space.rrt_connect(start, goal, np.random.default_rng(0), MAX_SAMPLES, RESOLUTION)
    assert tree is not None

    def rng() -> np.random.Generator:
        return np.random.default_rng(0)

    calls: dict[str, Callable[[], object]] = {
        "frames": lambda: backend.arm_frames(start[None]),
        "collision": lambda: space.free(start[None]),
        "collisions of 256": lambda: space.free(np.tile(start, (256, 1))),
        "line": lambda: space.line_is_free(start, start + 0.1, RESOLUTION),
        "via point": lambda: space.via_point_path(start, goal, rng(), RESOLUTION),
        "tree": lambda: space.rrt_connect(start, goal, rng(), MAX_SAMPLES, RESOLUTION),
        "shortening": lambda: space.shorten(tree, rng(), SHORTENING_TRIES, RESOLUTION),
        "pruning": lambda: space.straighten(tree, RESOLUTION),
        "four grasps": lambda: space.nearest_configurations(targets, start),
        "straight up": lambda: backend.linear_rows(start, grasp_pose(start), lift, 4),
    }
    for call in calls.values():
        call()  # loads it
    return {name: median_microseconds(call) for name, call in calls.items()}


def compare_kernels() -> Figures:
    """Each kernel: microseconds of compiled code and of numpy, and the ratio."""
    compiled, plain = measure_kernels(backend()), measure_kernels(NumpyBackend())
    return {
        name: {"us": compiled[name], "numpy_us": plain[name], "ratio": plain[name] / compiled[name]}
        for name in compiled
    }


def median_microseconds(call: Callable[[], object], repetitions: int = 31) -> float:
    """Median time of a call: other work on the machine matters less than to the mean."""
    times = []
    for _ in range(repetitions):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return float(np.median(times)) * 1e6


def microseconds(call: Callable[[], object], repetitions: int = 300) -> float:
    """Time of a call."""
    start = perf_counter()
    for _ in range(repetitions):
        call()
    return (perf_counter() - start) / repetitions * 1e6


def measure_inverse_kinematics(queries: int) -> dict[str, float]:
    """Measure inverse kinematics of grasps from above over the table, at any yaw."""
    rng = np.random.default_rng(1)
    times, found = [], 0
    for _ in range(queries):
        x, y, z = rng.uniform((0.3, -0.35, 0.1), (0.7, 0.35, 0.5)).tolist()
        pose = top_down(x, y, z, rng.uniform(-math.pi, math.pi))
        start = perf_counter()
        found += inverse_kinematics(pose, START) is not None
        times.append(perf_counter() - start)
    beyond = top_down(2.0, 0.0, 0.5)
    return {
        "median_us": float(np.median(times)) * 1e6,
        "out_of_reach_us": microseconds(lambda: inverse_kinematics(beyond, START)),
        "found": found / queries,
    }


def measure_collisions() -> dict[str, float]:
    """Measure queries against six boxes, the hand far from them and among them."""
    tower = [block(0.5, 0.0, ON_TABLE + 0.05 * i) for i in range(3)]
    free = CollisionChecker([TABLE, *tower, block(0.375, -0.2), block(0.5, 0.2)])
    rng = np.random.default_rng(2)
    beside = inverse_kinematics(top_down(0.45, -0.06, 0.2), START)
    assert beside is not None
    nearby = beside + rng.normal(0.0, 0.05, (256, 7))
    anywhere = rng.uniform(JOINT_LOW, JOINT_HIGH, (256, 7))
    return {
        "single_far_us": microseconds(lambda: free(START)),
        "single_near_us": microseconds(lambda: free(beside)),
        "in_256_near_us": microseconds(lambda: free(nearby), 20) / 256,
        "in_256_random_us": microseconds(lambda: free(anywhere), 20) / 256,
    }


def measure_plans(queries: int) -> Figures:
    """Measure plans: reach over a block, come down on it, and carry it past the tower."""
    rows: dict[str, list[dict[str, float]]] = {"reach": [], "approach": [], "carry": []}
    failed = dict.fromkeys(rows, 0)
    for seed, scene in enumerate(scenes(queries)):
        x, y, z = scene.block.pose.position
        around = CollisionChecker([TABLE, *scene.tower, scene.block])
        above = _plan(rows["reach"], START, top_down(x, y, z + APPROACH), around, seed)
        if above is None:
            failed["reach"] += 1
            continue
        grasp = _approach(rows["approach"], above, CollisionChecker([TABLE, *scene.tower]))
        if grasp is None:
            failed["approach"] += 1
            continue
        carrying = CollisionChecker([TABLE, *scene.tower], held=OrientedBox(Pose(), HALF))
        place = top_down(*scene.place, ON_TABLE + LIFT)
        failed["carry"] += _plan(rows["carry"], grasp, place, carrying, seed) is None
    return {
        kind: {**_summary(found), "failed": failed[kind] / (failed[kind] + len(found))}
        for kind, found in rows.items()
    }


def _plan(
    rows: list[dict[str, float]], q: Joints, pose: Pose, free: CollisionChecker, seed: int
) -> Joints | None:
    """Plan to a pose and note the figures; where the arm is then."""
    start = perf_counter()
    goal = inverse_kinematics(pose, q, free=free)
    if goal is None:
        return None
    try:
        path = plan_path(q, goal, free, seed=seed)
    except MotionPlanningError:
        return None
    motion = retime(path, free=free)
    rows.append(
        {
            "ms": (perf_counter() - start) * 1e3,
            "steps": len(motion),
            "straight": math.ceil(control_steps(q, goal) - 1e-9),
            "ten a piece": len(retime_fixed_steps(path)),
        }
    )
    return goal


def _approach(rows: list[dict[str, float]], q: Joints, free: CollisionChecker) -> Joints | None:
    """Come down on the block and note the figures; where the arm is then."""
    start = perf_counter()
    path = linear_motion(q, shifted(grasp_pose(q), (0.0, 0.0, -APPROACH)), free=free)
    if path is None:
        return None
    rows.append(
        {
            "ms": (perf_counter() - start) * 1e3,
            "steps": len(retime(path)),
            "straight": math.ceil(control_steps(path[0], path[-1]) - 1e-9),
            "ten a piece": len(retime_fixed_steps(path[[0, -1]])),
        }
    )
    return np.asarray(path[-1])


def _summary(rows: list[dict[str, float]]) -> dict[str, float]:
    if not rows:
        return {}
    times = [row["ms"] for row in rows]
    lengths = {
        name: float(np.mean([row[name] for row in rows]))
        for name in ("steps", "straight", "ten a piece")
    }
    return {"median_ms": float(np.median(times)), "most_ms": max(times), **lengths}


def main() -> None:
    """Measure and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--queries", type=int, default=100)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = {
        "inverse kinematics": measure_inverse_kinematics(arguments.queries),
        "collisions": measure_collisions(),
        **measure_plans(arguments.queries),
        **compare_kernels(),
    }
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
