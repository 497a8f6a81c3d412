# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Refuses states that no scene can be in."""

from __future__ import annotations

import math
from collections.abc import Sequence

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.joint_space.arm import Obstacle, Posture, Surroundings
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.snapshot import Snapshot
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, JOINT_HIGH, JOINT_LOW

# Pressed together, bodies overlap for a while by as much as a few centimetres; what overlaps
# by more than this was put there.
OVERLAP = 0.025  # m
UNIT_TOLERANCE = 1e-6  # 1, of a quaternion's length
HELD_TOLERANCE = 1e-3  # m and rad, between a held body and where the hand has it
LIMIT_TOLERANCE = 1e-9  # rad


def require_valid(
    scene: Scene,
    snapshot: Snapshot,
    materials: Sequence[Material],
    arm: Posture,
    obstacles: Surroundings[Obstacle],
) -> None:
    """Refuse a state that no scene can be in.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state; all numbers are finite.
        materials: Materials of the free bodies.
        arm: Arm in the snapshot's configuration.
        obstacles: Fixed bodies that are solid.

    Raises:
        InvalidStateError: A mass or friction that nothing has, a quaternion that is not
            normalised, joints beyond their limits, the arm or a body inside a fixed body, two
            bodies inside one another, or a held body that is not in the hand.
    """
    _require_materials(scene, materials)
    _require_rotations(scene, snapshot)
    for i, (low, q, high) in enumerate(zip(JOINT_LOW, snapshot.joints, JOINT_HIGH, strict=True)):
        if not low - LIMIT_TOLERANCE <= q <= high + LIMIT_TOLERANCE:
            raise InvalidStateError(f"joint {i + 1} = {q} rad is not within [{low}, {high}]")
    if not FINGER_CLOSED <= snapshot.finger <= FINGER_OPEN:
        raise InvalidStateError(f"finger = {snapshot.finger} m is not within [0, {FINGER_OPEN}]")
    if snapshot.held is not None:
        _require_in_hand(scene, snapshot, arm)
    if arm.to(arm).hits(obstacles):
        raise InvalidStateError("the arm, or what it holds, is inside a fixed body")
    _require_apart(scene, snapshot, obstacles)


def _require_materials(scene: Scene, materials: Sequence[Material]) -> None:
    for body, (mass, friction) in zip(scene.free, materials, strict=True):
        if mass <= 0.0:
            raise InvalidStateError(f"the mass of {body.name} is {mass} kg, which must be above 0")
        if friction < 0.0:
            raise InvalidStateError(
                f"the friction of {body.name} is {friction}, which must not be negative"
            )


def _require_rotations(scene: Scene, snapshot: Snapshot) -> None:
    quaternions = [(body.name, m.pose) for body, m in zip(scene.free, snapshot.bodies, strict=True)]
    for name, pose in [*quaternions, ("the grasp", snapshot.grasp)]:
        length = math.hypot(*pose.quaternion)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise InvalidStateError(f"the quaternion of {name} has length {length}, not 1")


def _require_in_hand(scene: Scene, snapshot: Snapshot, arm: Posture) -> None:
    assert snapshot.held is not None
    is_at: Pose = snapshot.bodies[snapshot.held].pose
    wanted = arm.held_pose
    off = max(math.dist(is_at.position, wanted.position), is_at.angle_to(wanted))
    if off > HELD_TOLERANCE:
        raise InvalidStateError(
            f"{scene.free[snapshot.held].name} is held, but not where the hand has it"
        )


def _require_apart(scene: Scene, snapshot: Snapshot, obstacles: Sequence[Obstacle]) -> None:
    placed = [
        (body.name, [core.shrunk(OVERLAP / 2) for core in body.cores(motion.pose)])
        for i, (body, motion) in enumerate(zip(scene.free, snapshot.bodies, strict=True))
        if i != snapshot.held
    ]
    fixed = [box.shrunk(OVERLAP / 2) for box, _ in obstacles]
    for i, (name, cores) in enumerate(placed):
        for other, others in placed[:i]:
            if _share_space(cores, others):
                raise InvalidStateError(f"{name} and {other} are inside one another")
        if _share_space(cores, fixed):
            raise InvalidStateError(f"{name} is inside a fixed body")


def _share_space(some: Sequence[OrientedBox], others: Sequence[OrientedBox]) -> bool:
    return any(
        other.near(box.pose.position, box.radius) and other.overlaps(box)
        for box in some
        for other in others
    )
