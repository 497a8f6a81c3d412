# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Panda's kinematics against PyBullet's own, and against themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slap_ros.geometry.pose import Pose, multiply
from slap_ros.worlds.bullet import PANDA, pybullet
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.joint_space.simulation import MESHES
from slap_ros.worlds.panda import (
    FINGER_OPEN,
    GRASP_POINT,
    HAND,
    HOME,
    JOINT_HIGH,
    JOINT_LOW,
    LINKS,
    MAX_STEP,
    grasp_pose,
    hand_pose,
    jacobian,
    link_poses,
)

URDF_LINKS = {  # name here: index there
    **{f"link{i}": i - 1 for i in range(1, 8)},
    "hand": 8,
    "left_finger": 9,
    "right_finger": 10,
}
HALF_TURN = (0.0, 0.0, 1.0, 0.0)  # about z


def configurations(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(JOINT_LOW, JOINT_HIGH, (count, 7))


@pytest.fixture
def urdf():
    client = pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(str(PANDA / "panda.urdf"), useFixedBase=True, physicsClientId=client)

    def poses(q, finger):
        for joint, value in [*enumerate(q), (9, finger), (10, finger)]:
            pybullet.resetJointState(robot, joint, value, 0.0, client)
        found = {}
        for name, index in URDF_LINKS.items():
            state = pybullet.getLinkState(
                robot, index, computeForwardKinematics=True, physicsClientId=client
            )
            found[name] = Pose(state[4], state[5])
        return found

    yield poses
    pybullet.disconnect(client)


def test_forward_kinematics_agree_with_the_urdf(urdf):
    for q in configurations(200):
        finger = 0.013
        theirs = urdf(q, finger)
        ours = dict(zip(LINKS, link_poses(q, finger), strict=True))
        for name, pose in theirs.items():
            mine = ours[name]
            if name == "right_finger":  # there, the shape is turned and not the link
                mine = Pose(mine.position, multiply(mine.quaternion, HALF_TURN))
            assert math.dist(mine.position, pose.position) < 1e-6
            assert mine.angle_to(pose) < 1e-6


def test_the_jacobian_agrees_with_finite_differences():
    step = 1e-6  # rad
    for q in configurations(50):
        columns = jacobian(q)
        for joint in range(7):
            there, back = q.copy(), q.copy()
            there[joint] += step
            back[joint] -= step
            ahead, behind = grasp_pose(there), grasp_pose(back)
            linear = np.subtract(ahead.position, behind.position) / (2 * step)
            turned = ahead.compose(behind.inverse()).quaternion
            angular = 2 * np.sign(turned[3]) * np.array(turned[:3]) / (2 * step)
            assert columns[:3, joint] == pytest.approx(linear, abs=1e-6)
            assert columns[3:, joint] == pytest.approx(angular, abs=1e-6)


def test_home_is_half_a_metre_ahead_and_up_pointing_down():
    grasp = grasp_pose(HOME)
    assert grasp.position == pytest.approx((0.5, 0.0, 0.5), abs=1e-12)
    assert grasp.apply((0.0, 0.0, 0.1)) == pytest.approx((0.5, 0.0, 0.4), abs=1e-12)
    assert grasp.apply((0.0, 0.1, 0.0)) == pytest.approx((0.5, -0.1, 0.5), abs=1e-12)
    assert np.all((np.array(HOME) > JOINT_LOW) & (np.array(HOME) < JOINT_HIGH))


def test_the_grasp_point_is_between_the_fingertips():
    poses = link_poses(HOME, FINGER_OPEN)
    left, right = poses[HAND + 1], poses[HAND + 2]
    middle = np.add(left.position, right.position) / 2
    assert math.dist(left.position, right.position) == pytest.approx(2 * FINGER_OPEN)
    assert math.dist(middle, grasp_pose(HOME).position) < 0.05
    reach = math.dist(hand_pose(HOME).position, grasp_pose(HOME).position)
    assert reach == pytest.approx(GRASP_POINT)


def test_the_speed_limit_is_the_references():
    assert MAX_STEP == (0.087, 0.053, 0.087, 0.045, 0.087, 0.057, 0.087)


@pytest.mark.parametrize("shape", LINK_SHAPES, ids=lambda shape: LINKS[shape.link])
def test_a_links_box_encloses_its_shape_closely(shape):
    text = (MESHES / shape.mesh).read_text()
    lines = [line.split() for line in text.splitlines() if line.startswith("v ")]
    vertices = [tuple(map(float, words[1:4])) for words in lines]
    inside = np.array([shape.frame.inverse().apply(vertex) for vertex in vertices])
    reach = np.abs(inside).max(axis=0)
    assert np.all(reach <= shape.half)
    assert np.all(np.array(shape.half) - reach < 5e-4)


def test_a_pose_and_its_inverse_undo_each_other():
    rng = np.random.default_rng(3)
    for _ in range(50):
        turn = rng.normal(size=4)
        pose = Pose(tuple(rng.normal(size=3)), tuple(turn / np.linalg.norm(turn)))
        back = pose.compose(pose.inverse())
        assert back.position == pytest.approx((0, 0, 0), abs=1e-12)
        assert abs(back.quaternion[3]) == pytest.approx(1.0)
        point = tuple(rng.normal(size=3))
        assert pose.inverse().apply(pose.apply(point)) == pytest.approx(point)
