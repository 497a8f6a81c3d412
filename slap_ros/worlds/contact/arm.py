# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arm's seven joints from the hand's pose, in closed form.

Of the configurations that have the hand there, it is the one whose elbow is in the vertical plane
through shoulder and wrist (joint 3 is 0), as a Panda stands in front of a table. So the joints are
a function of the hand's pose, without jumps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from slap_ros.geometry.pose import Pose, Vector, dot, multiply, rotate
from slap_ros.worlds.panda import GRASP_POINT, JOINT_HIGH, JOINT_LOW

Joints = tuple[float, ...]  # rad, seven

CONTROL_PERIOD_S = 0.05
# The arm's limits, from Franka's data sheet.
JOINT_SPEED = (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)  # rad/s
MAX_JOINT_STEP = tuple(speed * CONTROL_PERIOD_S for speed in JOINT_SPEED)  # rad
ROOM = 0.85  # of that, which plans use: a hand that was shoved may need the rest to be followed
# Where forearm and hand are in line, joints 5 and 7 turn about the same axis.
IN_LINE = math.pi - 0.1  # rad, of joint 6

_SHOULDER = 0.333  # m, height
_UPPER_ARM, _FOREARM = 0.316, 0.384  # m, along the axes of joints 3 and 5
_ELBOW = 0.0825  # m, from both of these axes to that of joint 4
_WRIST = 0.088  # m, from the axes of joints 5 and 6 to that of joint 7
_FLANGE = 0.107 + GRASP_POINT  # m, from the frame of link 7 to the grasp point, along its z
_EIGHTH_TURN = (0.0, 0.0, math.sin(math.pi / 8), math.cos(math.pi / 8))

_SINE = _ELBOW * (_UPPER_ARM + _FOREARM)
_COSINE = _ELBOW**2 - _UPPER_ARM * _FOREARM
_SIDES2 = _UPPER_ARM**2 + _FOREARM**2 + 2.0 * _ELBOW**2
_BEND = math.atan2(_SINE, _COSINE)
_CONVERGED = 1e-10  # rad, of joint 7
_MOST_ROUNDS = 20  # of which a hand tilted by 0.2 rad takes seven


def arm_joints(hand: Pose) -> Joints | None:
    """The configuration that has the hand there.

    Args:
        hand: Pose of the grasp point in the base's frame; the hand points about downwards.

    Returns:
        rad, within the limits; None if the pose is out of reach.
    """
    last = _LastLink.of(hand)
    # Joint 7 decides where the wrist is, and the wrist what joint 7 must be. They agree at once
    # if the hand points straight down; if not, the secant method finds where they do.
    guess = last.upright_joint7()
    joints = last.joints(guess)
    before = None
    for _ in range(_MOST_ROUNDS):
        if joints is None:
            return None
        off = joints[6] - guess
        if abs(off) < _CONVERGED:
            return _allowed(joints)
        slope = -1.0 if before is None else (off - before[1]) / (guess - before[0])
        before = guess, off
        guess -= off / slope if slope else off
        joints = last.joints(guess)
    return None


class _LastLink(NamedTuple):
    """The frame of link 7: its axes and origin in the base's frame."""

    x: Vector
    y: Vector
    z: Vector
    origin: Vector

    @classmethod
    def of(cls, hand: Pose) -> _LastLink:
        turn = multiply(hand.quaternion, _EIGHTH_TURN)
        axes = [rotate(turn, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        return cls(axes[0], axes[1], axes[2], Pose(hand.position, turn).apply((0.0, 0.0, -_FLANGE)))

    def upright_joint7(self) -> float:
        """Joint 7 if the hand points straight down."""
        x, y, _ = self.origin
        return math.atan2(-self.y[0] * x - self.y[1] * y, self.x[0] * x + self.x[1] * y)

    def joints(self, q7: float) -> Joints | None:
        """The configuration for the wrist that a joint 7 makes; its own joint 7 may differ."""
        c7, s7 = math.cos(q7), math.sin(q7)
        (px, py, pz), (ax, ay, az), (bx, by, bz) = self.origin, self.x, self.y
        wx = px - _WRIST * (c7 * ax - s7 * bx)
        wy = py - _WRIST * (c7 * ay - s7 * by)
        wz = pz - _WRIST * (c7 * az - s7 * bz)
        plane = _in_plane(math.hypot(wx, wy), wz - _SHOULDER)
        if plane is None:
            return None
        q2, q4 = plane
        q1, lean = math.atan2(wy, wx), q4 - q2
        c1, s1, cl, sl = math.cos(q1), math.sin(q1), math.cos(lean), math.sin(lean)
        forearm = (-sl * c1, -sl * s1, cl)
        zx, zy, zz = self.z
        ahead, aside = cl * (zx * c1 + zy * s1) + sl * zz, zy * c1 - zx * s1
        sign = math.copysign(1.0, ahead)
        q5 = math.atan2(sign * aside, sign * ahead)
        q6 = math.atan2(sign * math.hypot(ahead, aside), -dot(forearm, self.z))
        q7 = math.atan2(-sign * dot(forearm, self.y), sign * dot(forearm, self.x))
        return (q1, q2, 0.0, q4, q5, q6 % (2.0 * math.pi), q7)


def share_in_time(joints: Sequence[float], goal: Sequence[float]) -> float:
    """How much of the way to a configuration the arm can well go in a control period, up to 1.

    Args:
        joints: Present joint positions, rad.
        goal: Joint positions to go to, rad.
    """
    share = 1.0
    for q, wanted, step in zip(joints, goal, MAX_JOINT_STEP, strict=True):
        way = abs(wanted - q)
        if way * share > ROOM * step:
            share = ROOM * step / way
    return share


def in_time(joints: Joints, goal: Joints) -> bool:
    """Whether the arm can go from one configuration to another in a control period."""
    ways = zip(joints, goal, MAX_JOINT_STEP, strict=True)
    return all(abs(wanted - q) <= step for q, wanted, step in ways)


def _in_plane(ahead: float, above: float) -> tuple[float, float] | None:
    """Joints 2 and 4 for a wrist in the plane of the arm, seen from the shoulder, m; or None."""
    bend = (_SIDES2 - ahead * ahead - above * above) / (2.0 * math.hypot(_SINE, _COSINE))
    if abs(bend) > 1.0:
        return None
    q4 = _BEND + math.acos(bend) - 2.0 * math.pi
    c4, s4 = math.cos(q4), math.sin(q4)
    # From wrist to shoulder: along the axes of link 4, then along those of link 3.
    u, v = _ELBOW * (1.0 - c4) - _UPPER_ARM * s4, _ELBOW * s4 - _UPPER_ARM * c4 - _FOREARM
    a, b = u * c4 - v * s4, u * s4 + v * c4
    return math.atan2(above * a - ahead * b, -ahead * a - above * b), q4


def _allowed(joints: Joints) -> Joints | None:
    limits = zip(JOINT_LOW, joints, JOINT_HIGH, strict=True)
    if joints[5] > IN_LINE or not all(low <= q <= high for low, q, high in limits):
        return None
    return joints
