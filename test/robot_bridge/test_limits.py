# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing beyond a limit is ever made into a motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.errors import InvalidParameterError, UnsafeCommandError
from slap_ros.robot.limits import FR3, PANDA, Workspace, arm_limits
from slap_ros.worlds.panda import HOME, MAX_STEP, grasp_pose

PERIOD = 0.125  # s
ANYWHERE = Workspace((-9.0, -9.0, -9.0), (9.0, 9.0, 9.0))

number = st.one_of(
    st.floats(-0.2, 0.2), st.floats(), st.sampled_from([math.nan, math.inf, -math.inf])
)


def quintic(motion, times):
    """Position, velocity and acceleration along a motion, by its definition."""
    s = (times / motion.duration_s)[:, None]
    way = np.subtract(motion.target, motion.start)
    t = motion.duration_s
    return (
        np.array(motion.start) + way * (10 * s**3 - 15 * s**4 + 6 * s**5),
        way * (30 * s**2 - 60 * s**3 + 30 * s**4) / t,
        way * (60 * s - 180 * s**2 + 120 * s**3) / t**2,
    )


@settings(max_examples=300, deadline=None)
@given(st.lists(number, min_size=7, max_size=7), st.integers(0, 10_000))
def test_whatever_is_asked_for_a_motion_is_within_every_limit(displacement, seed):
    limits = FR3.scaled(0.5, Workspace())
    rng = np.random.default_rng(seed)
    start = np.array(HOME) + rng.uniform(-0.5, 0.5, 7)
    try:
        motion = limits.motion(start, start + np.array(displacement), PERIOD)
    except UnsafeCommandError:
        return
    q, v, a = quintic(motion, np.linspace(0.0, motion.duration_s, 201))
    slack = 1.0 + 1e-9
    assert motion.duration_s >= PERIOD
    assert (np.abs(v) <= np.array(FR3.velocity) * 0.5 * slack).all()
    assert (np.abs(a) <= np.array(FR3.acceleration) * 0.5 * slack).all()
    assert (np.abs(np.subtract(motion.target, start)) <= np.array(MAX_STEP) + 1e-6).all()
    assert (q[-1] >= FR3.low).all()
    assert (q[-1] <= FR3.high).all()
    for configuration in q[[50, 100, 150, 200]]:
        point = grasp_pose(configuration).position
        assert all(
            low - 0.01 <= x <= high + 0.01
            for low, x, high in zip(limits.workspace.low, point, limits.workspace.high, strict=True)
        )


def test_a_full_step_takes_as_long_as_the_accelerations_ask_for():
    """At the control rate it would take 32 rad/s^2 of a joint that has 15."""
    full = np.array(HOME) + np.array(MAX_STEP)
    motion = PANDA.motion(HOME, full, PERIOD)
    _, _, a = quintic(motion, np.linspace(0.0, motion.duration_s, 2001))
    assert motion.duration_s > PERIOD
    assert np.isclose((np.abs(a).max(axis=0) / PANDA.acceleration).max(), 1.0, atol=1e-4)


@pytest.mark.parametrize(
    ("joint", "value", "words"),
    [
        (0, math.nan, "joint 1 would go"),
        (3, math.inf, "joint 4 would go"),
        (0, HOME[0] + 0.1, "joint 1 would move by 0.1000 rad in one command"),
        (5, -5.0, "joint 6 would go to -5.0000 rad, beyond"),
    ],
)
def test_what_a_joint_must_not_do_is_refused_by_name(joint, value, words):
    target = list(HOME)
    target[joint] = value
    with pytest.raises(UnsafeCommandError, match=words):
        PANDA.motion(HOME, target, PERIOD)


def test_the_end_of_the_workspace_is_the_end():
    x, y, z = grasp_pose(HOME).position
    tight = PANDA.scaled(1.0, Workspace((x - 0.1, y - 0.1, z - 0.001), (x + 0.1, y + 0.1, z + 0.1)))
    lower = list(HOME)
    lower[1] += 0.05
    with pytest.raises(UnsafeCommandError, match="outside the workspace"):
        tight.motion(HOME, lower, PERIOD)
    tight.motion(HOME, HOME, PERIOD)


@pytest.mark.parametrize("fraction", [0.0, -1.0, 1.5, math.nan])
def test_speed_is_a_fraction(fraction):
    with pytest.raises(InvalidParameterError, match="fraction"):
        PANDA.scaled(fraction, ANYWHERE)


def test_unknown_arms_and_empty_workspaces_are_refused():
    with pytest.raises(InvalidParameterError, match="unknown arm"):
        arm_limits("ur5")
    with pytest.raises(InvalidParameterError, match="empty"):
        Workspace((0.0, 0.0, 0.5), (1.0, 1.0, 0.5))
