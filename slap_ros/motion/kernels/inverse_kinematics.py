# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of many poses, as :mod:`slap_ros.motion.numpy_inverse_kinematics`.

The symbols are explained there.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.collision_scene import CollisionScene
from slap_ros.motion.joints import HIGH, LOW, ROUNDING, Array, Joints
from slap_ros.motion.kernels.collision import is_free
from slap_ros.motion.kernels.lines import control_steps
from slap_ros.motion.kernels.separation import dot
from slap_ros.motion.kernels.trigonometry import arccos, arctan2, sin_cos
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
    """Write the nearest free configuration that is nearer than ``least``; whether there is one."""
    candidates = np.empty((len(joint7) * BRANCHES, JOINTS))
    steps = np.empty(len(candidates))
    for i in range(len(joint7)):
        _place_branches(last, joint7[i], near[0], candidates[i * BRANCHES : (i + 1) * BRANCHES])
    for i in range(len(candidates)):
        within = is_within_limits(candidates[i])
        steps[i] = control_steps(near, candidates[i]) if within else np.inf
    while True:
        best = np.argmin(steps)
        if not steps[best] < least:
            return False
        if is_free(candidates[best], scene):
            found[:] = candidates[best]
            return True
        steps[best] = np.inf


@inner
def is_within_limits(q: Joints) -> bool:
    """Whether every joint is within its limits; never for NaN."""
    for joint in range(JOINTS):
        if not (q[joint] >= LOW[joint] - ROUNDING and q[joint] <= HIGH[joint] + ROUNDING):
            return False
    return True


@inner
def _place_branches(last: Array, q7: float, joint1: float, branches: Joints) -> None:
    """Write the configuration of every branch, shape (8, 7): NaN where it does not reach."""
    sin7, cos7 = sin_cos(q7)
    x6, y6, z6, to_shoulder = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        x, y, z = last[i, 0], last[i, 1], last[i, 2]
        x6[i], y6[i], z6[i] = cos7 * x - sin7 * y, -z, sin7 * x + cos7 * y
        to_shoulder[i] = SHOULDER[i] - (last[i, 3] - WRIST * x6[i])
    swing = arccos((SIDES2 - dot(to_shoulder, to_shoulder)) / ELBOW_SCALE)
    shoulder_x, shoulder_y = dot(to_shoulder, x6), dot(to_shoulder, y6)
    branches[:] = np.nan
    for elbow in range(2):
        q4 = ELBOW_MIDDLE + (swing if elbow == 0 else -swing)
        sin4, cos4 = sin_cos(q4)
        along_x = ELBOW * (1.0 - cos4) - UPPER_ARM * sin4
        along_y = ELBOW * sin4 - UPPER_ARM * cos4 - FOREARM
        distance = math.sqrt(shoulder_x * shoulder_x + shoulder_y * shoulder_y)
        slant = arccos(along_y / distance)
        if math.isnan(slant):  # out of reach
            continue
        for wrist in range(2):
            q6 = arctan2(shoulder_x, shoulder_y) + (slant if wrist == 0 else -slant)
            sin6, cos6 = sin_cos(q6)
            first = 4 * elbow + 2 * wrist
            for q in branches[first : first + 2]:
                q[3], q[5], q[6] = _wrap(q4, -2.0 * PI), _wrap(q6, LOW[5]), q7
                q[4] = arctan2(dot(to_shoulder, z6), cos6 * shoulder_x - sin6 * shoulder_y)
            y4 = sin6 * x6 + cos6 * y6
            x4 = (to_shoulder - along_y * y4) / along_x
            _place_shoulder(x4, y4, sin4, cos4, joint1, branches[first : first + 2])


@inner
def _place_shoulder(
    x4: Array, y4: Array, sin4: float, cos4: float, joint1: float, branches: Joints
) -> None:
    """Write joints 1 to 3 of both ways to turn the shoulder."""
    x3, z3 = cos4 * x4 - sin4 * y4, sin4 * x4 + cos4 * y4
    y3_up = x4[1] * y4[0] - x4[0] * y4[1]
    upright = math.sqrt(z3[0] * z3[0] + z3[1] * z3[1]) < UPRIGHT
    tilt = arccos(min(max(z3[2], -1.0), 1.0))
    for shoulder in range(2):
        q, sign = branches[shoulder], 1.0 - 2.0 * shoulder
        q[1] = tilt * sign
        if upright:
            q[0], q[2] = joint1, _wrap(arctan2(x3[1], x3[0]) - joint1, -PI)
        else:
            q[0] = arctan2(sign * z3[1], sign * z3[0])
            q[2] = arctan2(sign * y3_up, -sign * x3[2])


@inner
def _wrap(angle: float, low: float) -> float:
    """The same angle in [low, low + 2 pi), from at most one turn beyond."""
    turn = 2.0 * PI
    if angle < low:
        return angle + turn
    return angle - turn if angle >= low + turn else angle
