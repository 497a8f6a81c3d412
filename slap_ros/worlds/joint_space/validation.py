# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Refuses states that no scene can be in."""

from __future__ import annotations

import math
from collections.abc import Sequence

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.joint_space.arm import Obstacle, Posture, Surroundings
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.snapshot import Snapshot
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN
from slap_ros.worlds.validation import require_joints_within_limits, require_rotations, share_space

# Pressed together, bodies overlap for a while by as much as a few centimetres; what overlaps
# by more than this was put there.
OVERLAP = 0.025  # m
HELD_TOLERANCE = 1e-3  # m and rad, between a held body and where the hand has it


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
    require_rotations(_poses(scene, snapshot))
    require_joints_within_limits(snapshot.joints)
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


def _poses(scene: Scene, snapshot: Snapshot) -> list[tuple[str, Pose]]:
    free = [(body.name, m.pose) for body, m in zip(scene.free, snapshot.bodies, strict=True)]
    return [*free, ("the grasp", snapshot.grasp)]


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
            if share_space(cores, others):
                raise InvalidStateError(f"{name} and {other} are inside one another")
        if share_space(cores, fixed):
            raise InvalidStateError(f"{name} is inside a fixed body")
