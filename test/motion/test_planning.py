# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Paths: free all along, exact at their ends, the same in every process, given up by count."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slap_ros.errors import ErrorCode, SkillNotApplicableError
from slap_ros.motion import (
    CollisionChecker,
    MotionPlanningError,
    PlanCache,
    control_steps,
    inverse_kinematics,
    path_steps,
    plan_path,
    within_limits,
)
from slap_ros.motion.joints import LOW, free_count, interpolate, path_configurations
from slap_ros.motion.shortcutting import shorten
from slap_ros.motion.via_point import via_point_path
from support.motion_scenes import (
    HELD,
    START,
    TABLE,
    block,
    random_box,
    random_configurations,
    top_down,
    tower,
)
from support.programs import PATH, environment

OVER_TOWER = [TABLE, *tower(0.5, 0.0)]


def across_the_tower():
    """A held block on one side of a tower, and where it goes on the other."""
    free = CollisionChecker(OVER_TOWER, held=HELD)
    start = inverse_kinematics(top_down(0.5, -0.2, 0.105), START, free=free)
    return start, inverse_kinematics(top_down(0.5, 0.2, 0.105), start, free=free), free


def check(path, start, goal, free):
    assert np.array_equal(path[0], start)
    assert np.array_equal(path[-1], goal)
    assert within_limits(path).all()
    # Half as far apart as the planner looks, and not at the same places.
    assert free(path_configurations(path, 0.0612)).mean() > 0.995
    assert free(path_configurations(path)).all()


def test_straight_where_that_is_free():
    goal = START + 0.1
    path = plan_path(START, goal, CollisionChecker([TABLE]), seed=0)
    np.testing.assert_array_equal(path, [START, goal])


def test_start_is_goal():
    np.testing.assert_array_equal(
        plan_path(START, START, CollisionChecker([TABLE]), seed=0), [START]
    )


def test_over_the_tower():
    start, goal, free = across_the_tower()
    assert not free(interpolate(start, goal)).all()
    path = plan_path(start, goal, free, seed=0)
    check(path, start, goal, free)
    assert path_steps(path) < 2.0 * control_steps(start, goal)


def test_a_single_bend_leads_over_the_tower():
    start, goal, free = across_the_tower()
    found = via_point_path(start, goal, free, np.random.default_rng(0), resolution=0.125)
    assert found.shape == (3, 7)
    check(found, start, goal, free)


def test_where_one_bend_is_not_enough_a_path_is_found_at_random():
    goal = START + np.array([2.0, 0, 0, 0, 0, 0, 0])

    def slalom(q):
        """Joint 1 passes one wall with joint 2 up, the next with joint 2 down."""
        first, second = (np.abs(q[:, 0] - wall) < 0.05 for wall in (0.5, 1.5))
        return (~first | (q[:, 1] > 0.1)) & (~second | (q[:, 1] < -0.4))

    assert via_point_path(START, goal, slalom, np.random.default_rng(0), resolution=0.125) is None
    path = plan_path(START, goal, slalom, seed=0)
    check(path, START, goal, slalom)
    assert len(path) > 3


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(115)  # a piece of a path, cut short, is seen to graze a box that the whole piece did not
def test_free_among_random_boxes(seed):
    rng = np.random.default_rng(seed)
    free = CollisionChecker([random_box(rng) for _ in range(4)])
    candidates = random_configurations(rng, 200)
    candidates = candidates[free(candidates)]
    if len(candidates) < 2:
        return
    start, goal = candidates[:2]
    try:
        path = plan_path(start, goal, free, seed=seed, attempts=1, max_samples=100)
    except MotionPlanningError:
        return
    check(path, start, goal, free)


def test_one_step_is_never_between_checked_configurations():
    line = interpolate(START, START + 1.0)
    assert control_steps(line[:-1], line[1:]).max() <= 0.125 + 1e-9
    assert np.array_equal(line[-1], START + 1.0)


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_free_count_is_the_first_that_is_not_free(allowed):
    line = np.arange(len(allowed), dtype=float)[:, None]
    free = np.array(allowed)
    expected = len(allowed) if free.all() else int(np.argmin(free))
    assert free_count(line, lambda q: free[q[:, 0].astype(int)]) == expected


def test_a_seed_fixes_the_path():
    start, goal, free = across_the_tower()
    path = plan_path(start, goal, free, seed=3)
    np.testing.assert_array_equal(plan_path(start, goal, free, seed=3), path)
    assert not np.array_equal(plan_path(start, goal, free, seed=4), path)


IN_ANOTHER_PROCESS = """
from test_planning import across_the_tower
from slap_ros.motion import plan_path
start, goal, free = across_the_tower()
print(plan_path(start, goal, free, seed=3).tobytes().hex())
"""


def test_another_process_finds_the_same_path(request):
    start, goal, free = across_the_tower()
    plan_path(start, goal, free, seed=5)  # what went before does not matter
    path = plan_path(start, goal, free, seed=3)
    other = subprocess.run(
        [sys.executable, "-c", IN_ANOTHER_PROCESS],
        env=environment() | {"PYTHONPATH": os.pathsep.join([PATH, str(request.path.parent)])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert other.stdout.strip() == path.tobytes().hex()


def test_out_of_reach_ends_by_count():
    count = 0

    def walled(q):
        """Joint 1 cannot pass a wall."""
        nonlocal count
        count += 1
        return np.abs(q[:, 0] - 0.5) > 0.05

    goal = START + np.array([1.0, 0, 0, 0, 0, 0, 0])
    with pytest.raises(MotionPlanningError, match="after 60 samples") as caught:
        plan_path(START, goal, walled, seed=0, max_samples=60)
    assert caught.value.code is ErrorCode.SKILL_NOT_APPLICABLE
    assert isinstance(caught.value, SkillNotApplicableError)
    assert count < 500


def test_ends_that_cannot_be():
    free = CollisionChecker([block(0.5, 0.0, 0.54)])
    with pytest.raises(MotionPlanningError, match=r"start .* in collision"):
        plan_path(START, START + 1.0, free, seed=0)
    with pytest.raises(MotionPlanningError, match=r"goal .* in collision"):
        plan_path(START + 0.7, START, free, seed=0)
    with pytest.raises(MotionPlanningError, match=r"goal .* not within the joint limits"):
        plan_path(START, LOW - 0.1, CollisionChecker([]), seed=0)


def test_shortening_keeps_ends_and_never_lengthens():
    rng = np.random.default_rng(8)
    path = random_configurations(rng, 6)

    def all_free(q):
        return np.ones(len(q), bool)

    shorter = shorten(path, all_free, rng, tries=200, resolution=1.0)
    np.testing.assert_array_equal(shorter[[0, -1]], path[[0, -1]])
    assert path_steps(shorter) < 1.2 * control_steps(path[0], path[-1])


def test_cache_gives_the_same_path_at_once(monkeypatch):
    start, goal, free = across_the_tower()
    cache = PlanCache()
    path = cache.plan_path(start, goal, free, seed=3)
    np.testing.assert_array_equal(path, plan_path(start, goal, free, seed=3))
    monkeypatch.setattr("slap_ros.motion.cache.plan_path", None)  # not asked again
    same_scene = CollisionChecker(OVER_TOWER, held=HELD)
    assert cache.plan_path(start.copy(), goal, same_scene, seed=(3,)) is path
    with pytest.raises(ValueError, match="read-only"):
        path[0] = 0.0


def test_cache_remembers_failures(monkeypatch):
    cache = PlanCache()
    palm = CollisionChecker([block(0.5, 0.0, 0.54)])
    with pytest.raises(MotionPlanningError, match="in collision"):
        cache.plan_path(START, START + 0.1, palm, seed=0)
    monkeypatch.setattr("slap_ros.motion.cache.plan_path", None)
    with pytest.raises(MotionPlanningError, match="in collision"):
        cache.plan_path(START, START + 0.1, palm, seed=0)


def test_cache_is_bounded():
    cache = PlanCache(capacity=2)
    free = CollisionChecker([TABLE])
    kept = cache.plan_path(START, START + 0.1, free, seed=0)
    for seed in range(1, 4):
        cache.plan_path(START, START + 0.1, free, seed=seed)
        assert cache.plan_path(START, START + 0.1, free, seed=0) is kept
    assert len(cache) == 2
