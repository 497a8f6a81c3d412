# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compiled motion is that of numpy to the bit: frames, collisions, lines, paths and trees."""

import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slap_ros
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import from_yaw
from slap_ros.motion import CollisionChecker, MotionPlanningError, plan_path, shifted
from slap_ros.motion.backend import backend
from slap_ros.motion.free_space import NumpyFreeSpace
from slap_ros.motion.joints import RESOLUTION, interpolate
from slap_ros.motion.kinematics import arm_frames, matrix
from slap_ros.motion.numpy_backend import NumpyBackend
from slap_ros.motion.numpy_collision import free_flags
from slap_ros.motion.numpy_kinematics import arm_frames as numpy_arm_frames
from slap_ros.portable_math import arccos, arctan2, sin_cos
from slap_ros.worlds.panda import Pose, grasp_pose
from support.motion_scenes import (
    HELD,
    STRAIGHT,
    TABLE,
    random_box,
    random_configurations,
    top_down,
    tower,
)
from support.programs import environment

pytest.importorskip("numba")
from slap_ros.motion.kernels import trigonometry
from slap_ros.motion.kernels.free_space import CompiledFreeSpace

SEEDS = st.integers(0, 2**32 - 1)


def scene(rng):
    """A checker of a random scene; in some, something is held."""
    boxes = [random_box(rng) for _ in range(rng.integers(0, 7))]
    held = HELD if rng.random() < 0.5 else None
    margin = rng.choice((-0.001, 0.005, 0.02))
    return CollisionChecker(boxes, held=held, held_margin=margin, base=bool(rng.random() < 0.8))


def by_numpy(free):
    return NumpyFreeSpace(partial(free_flags, free.scene))


def test_angles_are_the_same_one_by_one():
    angles = np.random.default_rng(0).uniform(-20.0, 20.0, 3000)
    angles[:5] = 0.0, np.pi / 2, -np.pi, 1e-300, np.nan
    sine, cosine = sin_cos(angles)
    others = angles[::-1].copy()
    slopes, arcs = arctan2(angles, others), arccos(np.clip(angles, -1.0, 1.0))
    for i, angle in enumerate(angles.tolist()):
        found = trigonometry.sin_cos(angle)
        np.testing.assert_array_equal(found, (sine[i], cosine[i]))
        np.testing.assert_array_equal(trigonometry.arctan2(angle, others[i]), slopes[i])
        np.testing.assert_array_equal(trigonometry.arccos(np.clip(angle, -1.0, 1.0)), arcs[i])


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_frames_and_collisions(seed):
    rng = np.random.default_rng(seed)
    free, q = scene(rng), random_configurations(rng, 300)
    assert isinstance(free.space, CompiledFreeSpace)
    np.testing.assert_array_equal(arm_frames(q), numpy_arm_frames(q))
    np.testing.assert_array_equal(free(q), by_numpy(free).free(q))


@settings(max_examples=12, deadline=None)
@given(SEEDS)
def test_inverse_kinematics(seed):
    rng = np.random.default_rng(seed)
    free, near = scene(rng), random_configurations(rng, 1)[0]
    poses = [grasp_pose(q) for q in random_configurations(rng, 3)]
    poses += [top_down(*rng.uniform(-0.7, 0.7, 3), rng.uniform(-3.0, 3.0)) for _ in range(3)]
    targets = np.array([matrix(pose) for pose in [*poses, top_down(2.0, 0.0, 0.0)]])
    found = free.space.nearest_configurations(targets, near)
    np.testing.assert_array_equal(found, by_numpy(free).nearest_configurations(targets, near))
    assert np.isnan(found[-1]).all()


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_straight_motions_of_the_hand(seed):
    """Python has turns as quaternions, so that rounding differs; also near singularities."""
    rng = np.random.default_rng(seed)
    for _ in range(5):
        q = random_configurations(rng, 1)[0]
        pose = grasp_pose(q)
        goal = shifted(pose, tuple(rng.uniform(-0.15, 0.15, 3).tolist()))
        if rng.random() < 0.5:
            goal = goal.compose(Pose((0.0, 0.0, 0.0), from_yaw(rng.uniform(-2.0, 2.0))))
        found, expected = (
            one.linear_rows(q, grasp_pose(q), goal, 7) for one in (backend(), NumpyBackend())
        )
        assert (found is None) == (expected is None)
        if found is not None:
            np.testing.assert_allclose(found, expected, atol=1e-7)


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_lines_and_paths(seed):
    rng = np.random.default_rng(seed)
    free = scene(rng)
    oracle = by_numpy(free)
    for _ in range(20):
        begin = random_configurations(rng, 1)[0]
        path = np.cumsum([begin, *rng.normal(0.0, 0.2, (2, 7))], axis=0)
        line = path[:2]
        assert free.space.path_is_free(path, RESOLUTION) == oracle.path_is_free(path, RESOLUTION)
        assert free.space.line_is_free(*line, 0.3) == oracle.line_is_free(*line, 0.3)


def test_every_configuration_of_a_line_is_checked():
    """A grain of dust anywhere on the way of the grasp point is seen."""
    rng = np.random.default_rng(3)
    start, goal = np.array([(-0.4, 0.2), (0.4, 0.3)] + [(0.0, 0.2)] * 5).T + random_start()
    line = interpolate(start, goal, 0.25)
    for row in rng.permutation(len(line)):
        dust = OrientedBox(Pose(grasp_pose(line[row]).position, STRAIGHT), (1e-4,) * 3)
        grain = OrientedBox(Pose(), (1e-4,) * 3)
        free = CollisionChecker([dust], held=grain, held_margin=0.0, margin=-0.2, base=False)
        expected = bool(free(line).all())
        assert not expected
        assert free.space.line_is_free(start, goal, 0.25) == expected


def random_start():
    return np.array((0.0, -0.2, 0.0, -1.9, 0.0, 1.6, 0.8))[None]


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_plans_and_the_random_numbers_behind_them(seed):
    rng = np.random.default_rng(seed)
    free = scene(rng)
    candidates = random_configurations(rng, 100)
    candidates = candidates[free(candidates)]
    if len(candidates) < 2:
        return
    plans = []
    for checker in (free, partial(free_flags, free.scene)):
        try:
            plan = plan_path(*candidates[:2], checker, seed=seed, attempts=2, max_samples=60)
        except MotionPlanningError as error:
            plan = str(error)
        plans.append(plan)
    np.testing.assert_array_equal(*plans)


@pytest.mark.parametrize("seed", range(6))
def test_trees_leave_the_generator_where_numpy_leaves_it(seed):
    free = CollisionChecker([TABLE, *tower(0.45, 0.0), *tower(0.45, 0.1)], held=HELD)
    start, goal = random_start()[0] - 0.5 * np.eye(7)[0], random_start()[0] + 0.6 * np.eye(7)[0]
    ends, rngs = (start, goal), [np.random.default_rng(seed) for _ in range(2)]
    found = [
        space.rrt_connect(*ends, rng, 300, RESOLUTION)
        for space, rng in zip((free.space, by_numpy(free)), rngs, strict=True)
    ]
    assert len(found[0]) > 2
    np.testing.assert_array_equal(*found)
    shorter = [
        space.straighten(space.shorten(path, rng, 20, RESOLUTION), RESOLUTION)
        for space, path, rng in zip((free.space, by_numpy(free)), found, rngs, strict=True)
    ]
    np.testing.assert_array_equal(*shorter)
    assert rngs[0].random() == rngs[1].random()


PROGRAM = """
import hashlib, sys
import numpy as np
from slap_ros.motion import CollisionChecker, plan_path
from slap_ros.motion.backend import backend
from support.motion_scenes import HELD, TABLE, tower
free = CollisionChecker([TABLE, *tower(0.45, 0.0), *tower(0.45, 0.1)], held=HELD)
start = np.array((-0.5, -0.2, 0.0, -1.9, 0.0, 1.6, 0.8))
goal = np.array((0.6, -0.2, 0.0, -1.9, 0.0, 1.6, 0.8))
plans = [plan_path(start, goal, free, seed=seed) for seed in range(3)]
print(type(backend()).__name__, hashlib.sha256(np.concatenate(plans).tobytes()).hexdigest())
"""
WITHOUT_NUMBA = "import sys; sys.modules['numba'] = None\n" + PROGRAM


def run(program, **variables):
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env=environment() | variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def result(process):
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out.split(), err


@pytest.mark.slow
def test_without_numba_plans_are_the_same():
    (name, digest), _ = result(run(PROGRAM))
    (other, same), _ = result(run(WITHOUT_NUMBA))
    assert (name, other) == ("CompiledBackend", "NumpyBackend")
    assert same == digest


def test_where_numba_is_told_to_compile_nothing_numpy_computes():
    program = "from slap_ros.motion.backend import backend; print(type(backend()).__name__)"
    assert result(run(program, NUMBA_DISABLE_JIT="1"))[0] == ["NumpyBackend"]


@pytest.mark.slow
def test_where_no_cache_can_be_written_code_is_compiled_again():
    program = """
import numpy as np
from slap_ros.compilation import cache_folder
from slap_ros.motion.kernels.kinematics import arm_frames
assert cache_folder() is None
print(arm_frames(np.zeros((1, 7))).shape)
"""
    done = run(program, XDG_CACHE_HOME="/dev/null")
    assert result(done)[0] == ["(1,", "7,", "4,", "4)"]


def test_where_no_cache_can_be_written_it_is_said():
    program = "from slap_ros.compilation import compile_once; compile_once([])"
    _, err = result(run(program, XDG_CACHE_HOME="/dev/null"))
    assert "cannot be kept in /dev/null/slap_ros/kernels" in err


SOURCES = Path(slap_ros.__file__).parent
PART = """
import numpy as np
from slap_ros.motion.kernels.kinematics import arm_frames
from slap_ros.compilation import compile_once
compile_once([lambda: arm_frames(np.zeros((1, 7)))])
print(arm_frames(np.ones((1, 7))).sum().hex(), sum(arm_frames.stats.cache_hits.values()))
"""


def other_checkout(folder):
    """The same sources elsewhere, and younger."""
    copy = folder / "checkout"
    shutil.copytree(SOURCES, copy / "slap_ros", ignore=shutil.ignore_patterns("__pycache__"))
    for source in copy.rglob("*.py"):
        source.touch()
    return {"PYTHONPATH": str(copy)}


@pytest.mark.slow
def test_processes_that_compile_at_once_and_other_checkouts_share_one_cache(tmp_path):
    both = [run(PART, XDG_CACHE_HOME=str(tmp_path)) for _ in range(2)]
    results = [result(process) for process in both]
    later = result(run(PART, XDG_CACHE_HOME=str(tmp_path), **other_checkout(tmp_path)))
    assert results[0][0][0] == results[1][0][0] == later[0][0]
    assert sum("compiling" in err for _, err in results) == 1
    assert "compiling" not in later[1]
    assert later[0][1] == "1"  # of the same sources elsewhere
