# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Retiming: within the joint limits a step, on the path, and as few steps as that allows."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.motion import path_steps, retime, retime_fixed_steps
from slap_ros.motion.joints import path_configurations
from slap_ros.worlds.panda import MAX_STEP
from support.motion_scenes import START

PATHS = st.builds(
    lambda seed, rows, scale: np.random.default_rng(seed).normal(0.0, scale, (rows, 7)),
    st.integers(0, 2**32 - 1),
    st.integers(2, 8),
    st.sampled_from((0.001, 0.05, 1.0)),
)


def steps_of(path, motion):
    return np.abs(np.diff(np.vstack([path[:1], motion]), axis=0))


def distance_to(path, q):
    """From a configuration to the nearest point of a path, rad."""
    best = math.inf
    for a, b in pairwise(path):
        along = np.clip((q - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
        best = min(best, float(np.linalg.norm(a + along * (b - a) - q)))
    return best


@settings(deadline=None)
@given(PATHS)
def test_as_fast_as_the_limits_allow(path):
    motion = retime(path)
    assert (steps_of(path, motion) <= np.array(MAX_STEP) + 1e-9).all()
    assert len(motion) == math.ceil(path_steps(path) - 1e-9)
    assert np.array_equal(motion[-1], path[-1])
    assert max(distance_to(path, q) for q in motion) < 1e-9


@settings(deadline=None)
@given(PATHS, st.integers(1, 12))
def test_multiples(path, multiple):
    motion = retime(path, steps_multiple=multiple)
    assert len(motion) % multiple == 0
    assert len(motion) < path_steps(path) + 1 + multiple
    assert (steps_of(path, motion) <= np.array(MAX_STEP) + 1e-9).all()
    checked = retime(path, steps_multiple=multiple, free=lambda q: np.ones(len(q), bool))
    assert len(checked) % multiple == 0
    assert (steps_of(path, checked) <= np.array(MAX_STEP) + 1e-9).all()


@pytest.mark.slow
@settings(deadline=None)
@given(PATHS)
def test_stops_at_corners_that_may_not_be_cut(path):
    def on_the_path(q):
        return np.array([distance_to(path, row) < 1e-9 for row in q])

    motion = retime(path, free=on_the_path, resolution=0.5)
    executed = np.vstack([path[:1], motion])  # joints move straight within a step
    assert on_the_path(path_configurations(executed, 0.5)).all()
    assert (steps_of(path, motion) <= np.array(MAX_STEP) + 1e-9).all()
    assert len(motion) <= path_steps(path) + len(path)


@pytest.mark.parametrize("path", [START[None], np.stack([START, START])])
def test_a_path_without_length_takes_no_step(path):
    assert retime(path).shape == (0, 7)
    assert retime(path, steps_multiple=10, free=lambda q: np.ones(len(q), bool)).shape == (0, 7)


def test_other_limits():
    path = np.stack([START, START + 0.1])
    assert len(retime(path, np.full(7, 0.01))) == 10


def test_in_tens():
    path = np.stack([START, START + 2.0, START + 2.1])
    motion = retime_fixed_steps(path)
    assert motion.shape == (20, 7)
    np.testing.assert_array_equal(motion[[9, 19]], path[1:])
    np.testing.assert_allclose(motion[:10], START + 0.2 * np.arange(1, 11)[:, None])
    assert retime_fixed_steps(START[None]).shape == (0, 7)
    assert len(retime_fixed_steps(path, 30)) == 60


def test_in_tens_for_each_radian_begun():
    path = np.stack([START, START + 2.0, START + 2.1, START + 2.1])
    motion = retime_fixed_steps(path, per_radian=True)
    assert motion.shape == (30, 7)
    np.testing.assert_array_equal(motion[[19, 29]], path[1:3])
