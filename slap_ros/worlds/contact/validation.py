# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes that cannot be."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.hand import LEASH, PAD, YAW_LEASH, HandState, rotation_between, wrapped
from slap_ros.worlds.contact.scene import ContactScene, JointKind
from slap_ros.worlds.contact.snapshot import ContactSnapshot, Placement
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, grasp_pose
from slap_ros.worlds.validation import require_joints_within_limits, require_rotations, share_space

# Pressed together, bodies overlap by a few millimetres; what overlaps by more was put there.
OVERLAP = 0.01  # m
ARM_TOLERANCE = 1e-6  # m and rad, between the hand and where the arm's joints have it
TARGET_TOLERANCE = 2.0  # times the leash
TILTED = 0.5  # rad, from pointing straight down
FAR = 50.0  # m, from the base: nothing gets there
FAST = 20.0  # m/s: nothing becomes that fast
FAST_SPIN = 500.0  # rad/s
GRASP_GAP = 0.003  # m, at most, between a pad and what is held

NamedBoxes = tuple[str, Sequence[OrientedBox]]  # inside a body, with its name


def require_possible(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement, gripper: float
) -> None:
    """Refuse scenes that cannot be.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state; all numbers are finite.
        placement: Poses of the bodies that do not move.
        gripper: Last gripper command, as the state has it.

    Raises:
        InvalidStateError: Names the value that is wrong, and what would be right.
    """
    require_rotations(_poses(scene, snapshot, placement))
    _require_near_and_slow(scene, snapshot, placement)
    _require_hand(snapshot.hand, gripper)
    _require_arm(snapshot)
    _require_openings(scene, snapshot)
    movable = [*_movable(scene, snapshot, placement), ("the hand", snapshot.hand.boxes())]
    _require_apart(scene, placement, movable)
    _require_held(scene, snapshot)


def require_possible_bodies(
    scene: ContactScene,
    snapshot: ContactSnapshot,
    placement: Placement,
    unseen: Collection[str] = (),
) -> None:
    """Refuse bodies that cannot be as they were detected, wherever encoders have the hand.

    An arm that is pushed has its hand where this world's could not have it, and fingers are
    narrower than this world's: that is so, and no error of measurement.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state; all numbers are finite.
        placement: Poses of the bodies that do not move.
        unseen: Names of bodies that are where they are assumed to be: these may be in others.

    Raises:
        InvalidStateError: Names the value that is wrong, and what would be right.
    """
    require_rotations(_poses(scene, snapshot, placement))
    _require_near_and_slow(scene, snapshot, placement)
    _require_openings(scene, snapshot)
    movable = _movable(scene, snapshot, placement)
    _require_apart(scene, placement, [one for one in movable if one[0] not in unseen])


def _require_near_and_slow(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement
) -> None:
    for name, pose in _poses(scene, snapshot, placement):
        away = max(abs(x) for x in pose.position)
        if away > FAR:
            raise InvalidStateError(f"{name} is {away} m away, further than {FAR} m")
    hand = snapshot.hand
    moving: list[tuple[str, Sequence[float], Sequence[float]]] = [
        ("the hand", hand.velocity, hand.angular_velocity),
        ("a finger", hand.finger_velocities, ()),
    ]
    for body, motion in zip(scene.free, snapshot.bodies, strict=True):
        moving.append((body.name, motion.velocity, motion.angular_velocity))
    for jointed, opening in zip(scene.jointed, snapshot.openings, strict=True):
        slides, rate = jointed.joint.kind is JointKind.SLIDE, (opening.velocity,)
        moving.append((jointed.name, rate if slides else (), () if slides else rate))
    for name, velocity, spin in moving:
        for values, unit, limit in ((velocity, "m/s", FAST), (spin, "rad/s", FAST_SPIN)):
            fastest = max((abs(value) for value in values), default=0.0)
            if fastest > limit:
                raise InvalidStateError(
                    f"{name} moves at {fastest} {unit}, more than {limit}, which nothing does"
                )


def _require_hand(hand: HandState, gripper: float) -> None:
    for name, finger in zip(("left", "right"), hand.fingers, strict=True):
        if not FINGER_CLOSED <= finger <= FINGER_OPEN:
            raise InvalidStateError(
                f"the {name} finger is at {finger} m, not within [{FINGER_CLOSED}, {FINGER_OPEN}]"
            )
    if gripper not in (-1.0, 1.0):
        raise InvalidStateError(f"gripper = {gripper}, must be 1 (closes) or -1 (opens)")
    upright = Pose(quaternion=hand.target_pose.quaternion)
    tilt_x, tilt_y, _ = rotation_between(upright, hand.pose)
    tilt = math.hypot(tilt_x, tilt_y)
    if tilt > TILTED:
        raise InvalidStateError(f"the hand is tilted by {tilt} rad; it points down")
    lead = max(abs(t - x) for t, x in zip(hand.target, hand.pose.position, strict=True))
    if lead > TARGET_TOLERANCE * LEASH:
        raise InvalidStateError(f"the hand's target is {lead} m away from it, leash {LEASH} m")
    turn = abs(wrapped(hand.target_yaw - hand.yaw))
    if turn > TARGET_TOLERANCE * YAW_LEASH:
        raise InvalidStateError(f"the hand's target is {turn} rad off, leash {YAW_LEASH} rad")


def _require_arm(snapshot: ContactSnapshot) -> None:
    require_joints_within_limits(snapshot.joints)
    hand = snapshot.hand
    if arm_joints(hand.pose) is None:
        raise InvalidStateError(f"the arm cannot have its hand at {hand.pose.position} m")
    at = grasp_pose(snapshot.joints)
    off, turn = math.dist(at.position, hand.pose.position), at.angle_to(hand.pose)
    if max(off, turn) > ARM_TOLERANCE:
        raise InvalidStateError(
            f"the hand is {off} m and {turn} rad off from where the arm's joints have it"
        )


def _require_openings(scene: ContactScene, snapshot: ContactSnapshot) -> None:
    for body, opening in zip(scene.jointed, snapshot.openings, strict=True):
        high = body.joint.high
        if not 0.0 <= opening.position <= high:
            raise InvalidStateError(
                f"the opening of {body.name} is {opening.position}, not within [0, {high}]"
            )


def hand_obstacles(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement
) -> list[OrientedBox]:
    """What the hand must not be inside: everything solid, but not what it holds.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state.
        placement: Poses of the bodies that do not move.

    Returns:
        Boxes inside these bodies.
    """
    free = _free(scene, snapshot)
    loose = (one for i, one in enumerate(free) if i != snapshot.held)
    others = (*loose, *_jointed(scene, snapshot, placement), *_fixed(scene, placement))
    return [box for _, boxes in others for box in boxes]


def too_deep(some: Sequence[OrientedBox], others: Sequence[OrientedBox]) -> bool:
    """Whether any of some boxes is deeper inside any of others than bodies that are pressed."""
    return share_space(_pressed(some), _pressed(others))


def _require_apart(
    scene: ContactScene, placement: Placement, movable: Iterable[NamedBoxes]
) -> None:
    """Refuse what is inside something else; a jointed body may be inside itself."""
    placed = [(name, _pressed(boxes)) for name, boxes in _fixed(scene, placement)]
    for name, boxes in movable:
        cores = _pressed(boxes)
        for other, others in placed:
            if share_space(cores, others):
                raise InvalidStateError(f"{name} and {other} are inside one another")
        placed.append((name, cores))


def _movable(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement
) -> list[NamedBoxes]:
    """Boxes inside each body that moves, or of which a part does."""
    return [*_free(scene, snapshot), *_jointed(scene, snapshot, placement)]


def _free(scene: ContactScene, snapshot: ContactSnapshot) -> list[NamedBoxes]:
    return [
        (body.name, body.cores(motion.pose))
        for body, motion in zip(scene.free, snapshot.bodies, strict=True)
    ]


def _jointed(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement
) -> list[NamedBoxes]:
    return [
        (body.name, body.cores(pose, opening.position))
        for body, pose, opening in zip(
            scene.jointed, placement.jointed, snapshot.openings, strict=True
        )
    ]


def _fixed(scene: ContactScene, placement: Placement) -> list[NamedBoxes]:
    return [
        (body.name, body.cores(pose))
        for body, pose in zip(scene.fixed, placement.fixed, strict=True)
        if body.solid
    ]


def _pressed(boxes: Sequence[OrientedBox]) -> list[OrientedBox]:
    """Boxes less what pressed bodies overlap by."""
    return [box.shrunk(OVERLAP / 2) for box in boxes]


def _require_held(scene: ContactScene, snapshot: ContactSnapshot) -> None:
    """Refuse that a body is held which the pads do not touch."""
    if snapshot.held is None:
        return
    body, motion = scene.free[snapshot.held], snapshot.bodies[snapshot.held]
    parts = [part.bounding_box.at(motion.pose) for part in body.parts]
    for pad in (box for box in snapshot.hand.boxes() if box.half == PAD.half_extents_m):
        if not share_space([pad.grown(GRASP_GAP)], parts):
            raise InvalidStateError(f"{body.name} is held, but not between the fingers")


def _poses(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement
) -> list[tuple[str, Pose]]:
    free = [(b.name, motion.pose) for b, motion in zip(scene.free, snapshot.bodies, strict=True)]
    fixed = [(b.name, pose) for b, pose in zip(scene.fixed, placement.fixed, strict=True)]
    jointed = [(b.name, pose) for b, pose in zip(scene.jointed, placement.jointed, strict=True)]
    return [("the hand", snapshot.hand.pose), *free, *fixed, *jointed]
