# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grasping and releasing. A grasp is a rigid attachment of one body to the hand.

The gripper acts at the beginning of a control step, before the arm moves, and at once. It closes
only around something it can grasp, and otherwise stays open; the fingers then stand at the body's
sides. A released body starts without velocity: the hand is taken to stand still between steps.
"""

from __future__ import annotations

import math
from dataclasses import replace

from slap_ros.geometry.pose import IDENTITY, Pose, conjugate, normalised, rotate
from slap_ros.worlds.joint_space.scene import Body, Scene
from slap_ros.worlds.joint_space.snapshot import Snapshot
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import FINGER_OPEN, grasp_pose, hand_pose

GRASP_REACH = 0.01  # m, between the grasp point and a body's centre
CLOSE, OPEN = 0.5, -0.5  # gripper commands beyond which it closes or opens


def grip(scene: Scene, snapshot: Snapshot, command: float) -> Snapshot:
    """What the gripper command changes before the arm moves.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state before the command.
        command: Gripper command: above 0.5 closes, below -0.5 opens, anything between does nothing.

    Returns:
        How it is afterwards; the same object where nothing changes.
    """
    if command > CLOSE and snapshot.held is None:
        return _grasp(scene, snapshot)
    if command < OPEN and snapshot.held is not None:
        return _release(snapshot)
    return snapshot


def _grasp(scene: Scene, snapshot: Snapshot) -> Snapshot:
    """Attach the free body nearest to the grasp point, if one is within reach."""
    if not snapshot.bodies:
        return snapshot
    point = grasp_pose(snapshot.joints).position
    distances = [math.dist(point, motion.pose.position) for motion in snapshot.bodies]
    nearest = min(range(len(distances)), key=distances.__getitem__)
    if distances[nearest] > GRASP_REACH:
        return snapshot
    pose = snapshot.bodies[nearest].pose
    grasp = hand_pose(snapshot.joints).inverse().compose(pose)
    grasp = Pose(grasp.position, normalised(grasp.quaternion))
    grasped = replace(
        snapshot, held=nearest, grasp=grasp, finger=finger_around(scene.free[nearest], grasp)
    )
    return grasped.moved(nearest, BodyState(pose))


def _release(snapshot: Snapshot) -> Snapshot:
    return replace(snapshot, held=None, grasp=IDENTITY, finger=FINGER_OPEN)


def finger_around(body: Body, grasp: Pose) -> float:
    """Where the fingers stand at a held body's sides, m from the middle."""
    # The way the fingers move, seen from the body.
    along = rotate(conjugate(grasp.quaternion), (0.0, 1.0, 0.0))
    return min(FINGER_OPEN, body.extent(along) + abs(grasp.position[1]))
