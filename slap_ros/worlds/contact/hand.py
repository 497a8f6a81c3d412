# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hand: its shape, how it is pulled to its target, and its own way where it touches nothing.

Its frame is the grasp point between the fingertips, z out of the hand, fingers along y. It is a
body of its own: no arm carries it. What pulls it takes, in each substep, a fixed share of the way
that is left, with limited force: that is what an operational-space controller makes of an arm.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import (
    ORIGIN,
    Pose,
    Quaternion,
    Vector,
    conjugate,
    from_rotation_vector,
    multiply,
)
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.hand_model import HandModel
from slap_ros.worlds.contact.scene import BoxPart
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN

HAND_MASS = 1.0  # kg
FINGER_MASS = 0.5  # kg each: lighter ones are kicked by what they grip
MASS = HAND_MASS + 2.0 * FINGER_MASS  # kg
HAND_INERTIA, FINGER_INERTIA = 0.01, 0.001  # kg m², about any axis

LEASH = 0.03  # m, from the hand to its target along each axis, at most
YAW_LEASH = 0.3  # rad, the same about the vertical

SUBSTEPS = 16  # of a control period; a power of two: 1/320 s, and exact
FINGER_SHARE = 0.2  # of a finger's way, gone in a substep where its speed and force allow it
SUBSTEP_S = CONTROL_PERIOD_S / SUBSTEPS
ARRIVED = 1e-7  # m and rad, and per s: nearer and slower than this, the hand is at its target

# In the hand's frame, at finger position 0: like the shapes of the real one.
PALM = BoxPart((0.0317, 0.102, 0.046), Pose((0.0, 0.0, -0.0834)))
PAD = BoxPart((0.0090, 0.0072, 0.0100), Pose((0.0, 0.0072, -0.0011)))  # of the left finger
STEM = BoxPart((0.0105, 0.0070, 0.0180), Pose((0.0, 0.0194, -0.0270)))  # what it is on
HALF_TURN = (0.0, 0.0, 1.0, 0.0)  # from the left finger to the right one


class HandState(NamedTuple):
    """How the hand is and moves, and its last command."""

    pose: Pose  # of the grasp point, in the base's frame
    velocity: Vector  # m/s
    angular_velocity: Vector  # rad/s
    target: Vector  # m, where it is pulled
    target_yaw: float  # rad; not wrapped
    fingers: tuple[float, float]  # m, distance of left and right from the middle
    finger_velocities: tuple[float, float]  # m/s
    closing: bool  # what the gripper was told last

    @property
    def target_pose(self) -> Pose:
        """The pose that the hand is pulled to."""
        return Pose(self.target, pointing_down(self.target_yaw))

    @property
    def yaw(self) -> float:
        """The yaw of the hand, rad, within half a turn of its target's."""
        x, y, _, _ = self.pose.quaternion
        return self.target_yaw + wrapped(2.0 * math.atan2(y, x) - self.target_yaw)

    def boxes(self) -> tuple[OrientedBox, ...]:
        """The space that palm and fingers fill."""
        left, right = self.fingers
        turned = Pose(self.pose.position, multiply(self.pose.quaternion, HALF_TURN))
        return (
            _placed(PALM, self.pose, 0.0),
            *(_placed(part, self.pose, left) for part in (PAD, STEM)),
            *(_placed(part, turned, right) for part in (PAD, STEM)),
        )


def pointing_down(yaw: float) -> Quaternion:
    """The orientation of a hand that points straight down, turned about the vertical."""
    return (math.cos(0.5 * yaw), math.sin(0.5 * yaw), 0.0, 0.0)


def wrapped(angle: float) -> float:
    """The same angle within [-pi, pi), rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def hand_at(
    position: Vector, yaw: float = 0.0, finger: float = FINGER_OPEN, closing: bool = False
) -> HandState:
    """A hand that points down, at its target and at rest.

    Args:
        position: Position of the grasp point, m.
        yaw: Yaw about the vertical, rad; at 0 the fingers move along the base's y.
        finger: Distance of each finger from the middle, m.
        closing: Whether the gripper was last told to close.
    """
    return HandState(
        Pose(position, pointing_down(yaw)),
        ORIGIN,
        ORIGIN,
        position,
        yaw,
        (finger, finger),
        (0.0, 0.0),
        closing,
    )


def own_way(hand: HandState, pull: Pose, model: HandModel) -> HandState:
    """The hand after a control period in which it touches nothing.

    What PyBullet makes of the same, to a few micrometres.

    Args:
        hand: Hand at the beginning of the period.
        pull: Pose that the hand is pulled to in this period.
        model: What the hand can do.
    """
    kick = model.pull_n / MASS * SUBSTEP_S  # m/s, the most that a substep changes
    ways = [
        _pulled(goal - x, v, kick, model.share)
        for goal, x, v in zip(pull.position, hand.pose.position, hand.velocity, strict=True)
    ]
    x, y, z = (goal - left for goal, (left, _) in zip(pull.position, ways, strict=True))
    inertia = HAND_INERTIA + 2.0 * FINGER_INERTIA
    twist = model.pull_n / inertia * SUBSTEP_S  # rad/s
    turns = [
        _pulled(left, w, twist, model.share)
        for left, w in zip(rotation_between(hand.pose, pull), hand.angular_velocity, strict=True)
    ]
    back = from_rotation_vector((-turns[0][0], -turns[1][0], -turns[2][0]))
    quaternion = multiply(back, pull.quaternion) if any(r for r, _ in turns) else pull.quaternion
    open_to = FINGER_CLOSED if hand.closing else FINGER_OPEN
    squeeze = model.grip_n / FINGER_MASS * SUBSTEP_S
    fingers = [
        _pulled(open_to - f, v, squeeze, FINGER_SHARE, model.finger_speed)
        for f, v in zip(hand.fingers, hand.finger_velocities, strict=True)
    ]
    return hand._replace(
        pose=Pose((x, y, z), quaternion),
        velocity=(ways[0][1], ways[1][1], ways[2][1]),
        angular_velocity=(turns[0][1], turns[1][1], turns[2][1]),
        fingers=(open_to - fingers[0][0], open_to - fingers[1][0]),
        finger_velocities=(fingers[0][1], fingers[1][1]),
    )


def rotation_between(start: Pose, goal: Pose) -> Vector:
    """The turn from one orientation to another: axis times angle, rad, the shorter way."""
    x, y, z, w = multiply(goal.quaternion, conjugate(start.quaternion))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine < 1e-12:
        return ORIGIN
    rate = math.copysign(2.0 * math.atan2(sine, abs(w)) / sine, w)
    return (rate * x, rate * y, rate * z)


def _pulled(
    left: float, speed: float, kick: float, share: float, fastest: float = math.inf
) -> tuple[float, float]:
    """The remaining way along one axis, and the speed, after a control period.

    In each substep the speed becomes that which goes a share of the way that is left, or as near
    to it as the force allows.

    Args:
        left: Remaining way at the beginning, m or rad.
        speed: Speed at the beginning, m/s or rad/s.
        kick: Largest change of speed that the force makes in a substep, m/s or rad/s.
        share: Share of the way that is left, gone in a substep.
        fastest: Largest wanted speed, m/s or rad/s.
    """
    rate = share / SUBSTEP_S  # per s
    for done in range(SUBSTEPS):
        wanted = left * rate
        change = wanted - speed
        if -kick <= change <= kick and abs(wanted) <= min(fastest, kick / share):
            # From here on the force always suffices: each substep leaves the same share.
            left *= (1.0 - share) ** (SUBSTEPS - done)
            speed = left * rate / (1.0 - share)
            break
        if not -fastest <= wanted <= fastest:
            change = math.copysign(fastest, wanted) - speed
        speed += min(max(change, -kick), kick)
        left -= speed * SUBSTEP_S
    if abs(left) < ARRIVED and abs(speed) < ARRIVED:
        return 0.0, 0.0
    return left, speed


def _placed(part: BoxPart, hand: Pose, finger: float) -> OrientedBox:
    """The space of a part, on a finger that is so far from the middle."""
    x, y, z = part.pose.position
    return OrientedBox(hand.compose(Pose((x, y + finger, z))), part.half_extents_m)
