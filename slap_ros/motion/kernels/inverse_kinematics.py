# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of many poses, as :mod:`slap_ros.motion.numpy_inverse_kinematics`.

The symbols are explained there.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.geometry.pose import Vector
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import HIGH, LOW, ROUNDING, STEP, Array, Joints
from slap_ros.motion.kernels.collision import is_free
from slap_ros.motion.kernels.lines import control_steps
from slap_ros.motion.kernels.trigonometry import arccos, arctan2, sin_cos
from slap_ros.motion.kernels.vectors import difference, dot, scaled, total, vector
from slap_ros.motion.numpy_inverse_kinematics import (
    AROUND,
    BRANCHES,
    ELBOW,
    ELBOW_MIDDLE,
    ELBOW_SCALE,
    FOREARM,
    SHOULDER,
    SIDES2,
    TO_LAST_LINK,
    UPPER_ARM,
    UPRIGHT,
    WRIST,
)
from slap_ros.portable_math import PI
from slap_ros.worlds.panda import JOINTS

FROM_BASE = (float(SHOULDER[0]), float(SHOULDER[1]), float(SHOULDER[2]))


@compiled
def nearest(targets: Array, sweep: Array, near: Joints, scene: CollisionScene) -> Joints:
    """The free configuration at each pose that is the fewest control steps away; NaN for none.

    Args:
        targets: Poses of the grasp point, as homogeneous transforms, shape (n, 4, 4).
        sweep: Values of joint 7 to look at first, rad.
        near: Configuration to be near to, rad, shape (7,).
        scene: Shapes of the arm and the obstacles.
    """
    found = np.full((len(targets), JOINTS), np.nan)
    around = np.empty(len(AROUND))
    for i in range(len(targets)):
        last = _last_link(targets[i])
        if _place_nearest(last, sweep, near, scene, np.inf, found[i]):
            for k in range(len(AROUND)):
                around[k] = min(max(found[i, 6] + AROUND[k], LOW[6]), HIGH[6])
            least = control_steps(near, found[i])
            _place_nearest(last, around, near, scene, least, found[i])
    return found


@inner
def _last_link(target: Array) -> Array:
    """Where link 7 is for a pose of the grasp point: shape (3, 4)."""
    last = np.empty((3, 4))
    for row in range(3):
        for column in range(4):
            turned = dot(target[row, :3], TO_LAST_LINK[:3, column])
            last[row, column] = turned + target[row, 3] if column == 3 else turned
    return last


@inner
def _place_nearest(
    last: Array, joint7: Array, near: Joints, scene: CollisionScene, least: float, found: Joints
) -> bool:
    """Write the nearest free configuration that is nearer than ``least``; whether there is one.

    Of equally near ones it is the first. Values of joint 7 that are far away come last, for they
    are not looked at where something nearer was found.
    """
    away, branches = np.empty(len(joint7)), np.empty((BRANCHES, JOINTS))
    for i in range(len(joint7)):
        away[i] = abs(joint7[i] - near[6]) / STEP[6]
    first = -1  # of the nearest so far, among all branches of all values
    for i in np.argsort(away):
        if away[i] > least:
            break
        _place_branches(last, joint7[i], near, least, branches)
        for k in range(BRANCHES):
            if not is_within_limits(branches[k]):
                continue
            steps, number = control_steps(near, branches[k]), i * BRANCHES + k
            nearer = steps < least or (steps == least and number < first)
            if nearer and is_free(branches[k], scene):
                least, first = steps, number
                found[:] = branches[k]
    return first >= 0


@inner
def is_within_limits(q: Joints) -> bool:
    """Whether every joint is within its limits; never for NaN."""
    for joint in range(JOINTS):
        if not (q[joint] >= LOW[joint] - ROUNDING and q[joint] <= HIGH[joint] + ROUNDING):
            return False
    return True


@inner
def _place_branches(last: Array, q7: float, near: Joints, most: float, branches: Joints) -> None:
    """Write the configuration of every branch, shape (8, 7).

    NaN where a branch does not reach, or where a joint alone takes more than ``most`` steps.
    """
    sin7, cos7 = sin_cos(q7)
    last_x, last_y, last_z, origin = _columns(last)
    x6 = difference(scaled(cos7, last_x), scaled(sin7, last_y))
    y6 = scaled(-1.0, last_z)
    z6 = total(scaled(sin7, last_x), scaled(cos7, last_y))
    to_shoulder = difference(FROM_BASE, difference(origin, scaled(WRIST, x6)))
    swing = arccos((SIDES2 - dot(to_shoulder, to_shoulder)) / ELBOW_SCALE)
    shoulder_x, shoulder_y = dot(to_shoulder, x6), dot(to_shoulder, y6)
    distance = math.sqrt(shoulder_x * shoulder_x + shoulder_y * shoulder_y)
    middle, sideways = arctan2(shoulder_x, shoulder_y), dot(to_shoulder, z6)
    branches[:] = np.nan
    for elbow in range(2):
        bend = ELBOW_MIDDLE + (swing if elbow == 0 else -swing)
        q4 = _wrap(bend, -2.0 * PI)
        if not abs(q4 - near[3]) / STEP[3] <= most:
            continue
        sin4, cos4 = sin_cos(bend)
        along_x = ELBOW * (1.0 - cos4) - UPPER_ARM * sin4
        along_y = ELBOW * sin4 - UPPER_ARM * cos4 - FOREARM
        slant = arccos(along_y / distance)
        if math.isnan(slant):  # out of reach
            continue
        for wrist in range(2):
            lean = middle + (slant if wrist == 0 else -slant)
            q6 = _wrap(lean, LOW[5])
            if not abs(q6 - near[5]) / STEP[5] <= most:
                continue
            sin6, cos6 = sin_cos(lean)
            pair = branches[4 * elbow + 2 * wrist : 4 * elbow + 2 * wrist + 2]
            y4 = total(scaled(sin6, x6), scaled(cos6, y6))
            x4 = _divided(difference(to_shoulder, scaled(along_y, y4)), along_x)
            _place_shoulder(x4, y4, (sin4, cos4), near, most, pair)
            q5 = arctan2(sideways, cos6 * shoulder_x - sin6 * shoulder_y)
            for q in pair:
                q[3], q[4], q[5], q[6] = q4, q5, q6, q7


@inner
def _place_shoulder(
    x4: Vector, y4: Vector, turn4: tuple[float, float], near: Joints, most: float, branches: Joints
) -> None:
    """Write joints 1 to 3 of both ways to turn the shoulder."""
    sin4, cos4 = turn4
    x3 = difference(scaled(cos4, x4), scaled(sin4, y4))
    z3 = total(scaled(sin4, x4), scaled(cos4, y4))
    y3_up = x4[1] * y4[0] - x4[0] * y4[1]
    upright = math.sqrt(z3[0] * z3[0] + z3[1] * z3[1]) < UPRIGHT
    tilt = arccos(min(max(z3[2], -1.0), 1.0))
    for shoulder in range(2):
        q, sign = branches[shoulder], 1.0 - 2.0 * shoulder
        q[1] = tilt * sign
        if not abs(q[1] - near[1]) / STEP[1] <= most:
            continue
        if upright:
            q[0], q[2] = near[0], _wrap(arctan2(x3[1], x3[0]) - near[0], -PI)
        else:
            q[0] = arctan2(sign * z3[1], sign * z3[0])
            q[2] = arctan2(sign * y3_up, -sign * x3[2])


@inner
def _columns(frame: Array) -> tuple[Vector, Vector, Vector, Vector]:
    """The axes of a frame and its origin."""
    (a, b, c), (d, e, f), (g, h, i) = vector(frame[0]), vector(frame[1]), vector(frame[2])
    return (a, d, g), (b, e, h), (c, f, i), (frame[0, 3], frame[1, 3], frame[2, 3])


@inner
def _divided(a: Vector, divisor: float) -> Vector:
    return a[0] / divisor, a[1] / divisor, a[2] / divisor


@inner
def _wrap(angle: float, low: float) -> float:
    """The same angle in [low, low + 2 pi), from at most one turn beyond."""
    turn = 2.0 * PI
    if angle < low:
        return angle + turn
    return angle - turn if angle >= low + turn else angle
