# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linear motion: straight, in one branch, and refused where it cannot be."""

import math

import numpy as np

from slap_ros.motion import (
    CollisionChecker,
    control_steps,
    inverse_kinematics,
    linear_motion,
    retime,
    shifted,
    within_limits,
)
from slap_ros.motion.joints import path_configurations
from slap_ros.worlds.panda import Pose, grasp_pose
from support.motion_scenes import START, TABLE, block, random_configurations, top_down


def off_the_line(pose, start, goal):
    """Distance of a position from the line between two, m."""
    p, a, b = (np.array(x.position) for x in (pose, start, goal))
    along = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return float(np.linalg.norm(a + along * (b - a) - p))


def above_the_table(rng, count):
    while count:
        pose = top_down(*rng.uniform((0.35, -0.3, 0.15), (0.65, 0.3, 0.35)), rng.uniform(-1.5, 1.5))
        q = inverse_kinematics(pose, START)
        if q is not None:
            yield q
            count -= 1


def test_down_and_up_again_is_straight():
    reached = 0
    for q in above_the_table(np.random.default_rng(0), 100):
        start = grasp_pose(q)
        goal = shifted(start, (0.0, 0.0, -0.05))
        path = linear_motion(q, goal)
        if path is None:
            continue
        reached += 1
        assert np.array_equal(path[0], q)
        assert within_limits(path).all()
        end = grasp_pose(path[-1])
        assert math.dist(end.position, goal.position) < 1e-4
        assert end.angle_to(goal) < 1e-3
        assert control_steps(path[:-1], path[1:]).max() < 2.0
        executed = np.vstack([q, retime(path)])  # joints move straight within a step
        for row in path_configurations(executed):
            assert off_the_line(grasp_pose(row), start, goal) < 0.002
            assert grasp_pose(row).angle_to(start) < 0.02
    assert reached >= 95


def test_turning_on_the_way():
    start = grasp_pose(START)
    goal = Pose((0.45, 0.1, 0.4), top_down(0, 0, 0, 0.8).quaternion)
    path = linear_motion(START, goal)
    assert math.dist(grasp_pose(path[-1]).position, goal.position) < 1e-4
    assert grasp_pose(path[-1]).angle_to(goal) < 1e-3
    for row in path_configurations(path):
        assert off_the_line(grasp_pose(row), start, goal) < 0.002


def test_nowhere_to_go():
    path = linear_motion(START, grasp_pose(START))
    assert control_steps(path[0], path[-1]) < 1e-3
    assert len(retime(path)) <= 1


def test_out_of_reach_is_none():
    assert linear_motion(START, shifted(grasp_pose(START), (0.6, 0.0, 0.0))) is None


def test_no_branch_jump_near_singularities():
    rng = np.random.default_rng(2)
    for q in random_configurations(rng, 100):
        displacement = rng.normal(0.0, 0.05, 3)
        path = linear_motion(q, shifted(grasp_pose(q), tuple(displacement.tolist())))
        if path is not None:
            assert control_steps(path[:-1], path[1:]).max() <= 2.0


def test_a_collision_is_none():
    pose = top_down(0.5, 0.0, 0.2)
    q = inverse_kinematics(pose, START)
    down = shifted(pose, (0.0, 0.0, -0.08))
    assert linear_motion(q, down, free=CollisionChecker([TABLE])) is not None
    in_the_way = block(0.5, 0.04, 0.1)
    assert linear_motion(q, down, free=CollisionChecker([TABLE, in_the_way])) is None
