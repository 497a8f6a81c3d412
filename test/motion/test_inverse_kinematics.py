# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: exact, complete over branches, nearest, and quick to say no."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.motion import (
    CollisionChecker,
    control_steps,
    ik_candidates,
    ik_solutions,
    inverse_kinematics,
    nearest_configurations,
    within_limits,
)
from slap_ros.motion.kinematics import arm_frames, matrix
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, Pose, grasp_pose, link_poses
from support.motion_scenes import START, TABLE, random_configurations, top_down


def offsets(q, pose):
    """How far the grasp point is from a pose: m and rad."""
    reached = grasp_pose(q)
    return math.dist(reached.position, pose.position), reached.angle_to(pose)


def test_forward_kinematics_agrees_with_the_panda():
    q = random_configurations(np.random.default_rng(0), 100)
    for frames, row in zip(arm_frames(q), q, strict=True):
        expected = np.stack([matrix(pose) for pose in link_poses(row, 0.04)[1:8]])
        np.testing.assert_allclose(frames, expected, atol=1e-12)


def test_every_configuration_is_among_the_solutions_at_its_pose():
    for q in random_configurations(np.random.default_rng(1), 500):
        found = ik_solutions(grasp_pose(q), q[6:])
        assert np.abs(found - q).max(1).min() < 1e-6


def test_all_solutions_are_exact_and_within_limits():
    for q in random_configurations(np.random.default_rng(2), 50):
        pose = grasp_pose(q)
        found = ik_candidates(pose, q)
        assert within_limits(found).all()
        for solution in found:
            position, angle = offsets(solution, pose)
            assert position < 1e-9
            assert angle < 1e-7


def test_solution_is_the_nearest_of_a_dense_sweep():
    dense = np.linspace(JOINT_LOW[6], JOINT_HIGH[6], 4000)
    pairs = random_configurations(np.random.default_rng(5), 300).reshape(-1, 2, 7)
    excess = []
    for q, near in pairs:
        found = inverse_kinematics(grasp_pose(q), near)
        best = control_steps(near, ik_solutions(grasp_pose(q), dense)).min(initial=np.inf)
        excess.append(np.inf if found is None else control_steps(near, found) - best)
    # A sweep can miss a sliver of the redundancy, never much of it.
    assert np.mean(np.array(excess) < 0.5) >= 0.97


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_solutions_reach_the_pose_from_anywhere(seed):
    q, near = random_configurations(np.random.default_rng(seed), 2)
    found = inverse_kinematics(grasp_pose(q), near)
    if found is not None:
        assert within_limits(found)
        position, angle = offsets(found, grasp_pose(q))
        assert position < 1e-4
        assert angle < 1e-3


def test_a_pose_is_found_again_from_its_own_configuration():
    for q in random_configurations(np.random.default_rng(3), 100):
        assert control_steps(q, inverse_kinematics(grasp_pose(q), q)) < 1e-6


def test_top_down_poses_over_the_table_are_reached():
    rng = np.random.default_rng(4)
    count = 1000
    found = 0
    for _ in range(count):
        position, yaw = rng.uniform((0.3, -0.35, 0.1), (0.7, 0.35, 0.5)), rng.uniform(-3.14, 3.14)
        pose = top_down(*position, yaw)
        q = inverse_kinematics(pose, START)
        if q is None:
            # Truly out of reach: every pose that can be reached is found.
            assert len(ik_solutions(pose, np.linspace(JOINT_LOW[6], JOINT_HIGH[6], 5000))) == 0
            continue
        found += 1
        assert within_limits(q)
        assert max(offsets(q, pose)) < 1e-7
    assert found >= 0.98 * count


@pytest.mark.parametrize("position", [(2.0, 0.0, 0.5), (0.0, 0.0, 0.333), (0.9, 0.0, 0.9)])
def test_out_of_reach_is_none(position):
    assert inverse_kinematics(top_down(*position), START) is None


def test_only_free_configurations_are_given():
    pose = top_down(0.5, 0.1, 0.2)
    nearest = inverse_kinematics(pose, START)

    def free(q):
        return np.abs(q - nearest).max(-1) > 0.3

    other = inverse_kinematics(pose, START, free=free)
    assert free(other[None]).all()
    assert max(offsets(other, pose)) < 1e-7
    assert inverse_kinematics(pose, START, free=lambda q: np.zeros(len(q), bool)) is None


def test_below_the_table_nothing_is_free():
    below = top_down(0.5, 0.0, 0.0)
    assert inverse_kinematics(below, START) is not None
    assert inverse_kinematics(below, START, free=CollisionChecker([TABLE])) is None


def test_poses_together_are_as_each_alone():
    free = CollisionChecker([TABLE])
    heights = (0.2, 0.0, 0.3)  # the second is below the table
    poses = [top_down(0.5, 0.1, z, yaw) for yaw in (0.0, 1.0) for z in heights]
    poses.append(top_down(2.0, 0.0, 0.5))  # out of reach
    together = nearest_configurations(poses, START, free=free)
    assert [q is None for q in together] == [False, True, False, False, True, False, True]
    for pose, q in zip(poses, together, strict=True):
        alone = inverse_kinematics(pose, START, free=free)
        assert (alone is None) == (q is None)
        assert q is None or np.allclose(q, alone, atol=1e-12)


def test_upright_upper_arm_keeps_joint_1():
    q = np.array([0.7, 0.0, -0.4, -1.8, 0.3, 1.9, 0.5])
    found = inverse_kinematics(grasp_pose(q), q)
    assert control_steps(q, found) < 1e-4


def test_a_bad_configuration_is_refused():
    with pytest.raises(ValueError, match="7 finite"):
        inverse_kinematics(Pose(), np.zeros(6))
