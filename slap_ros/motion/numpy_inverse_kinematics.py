# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of the Panda in closed form, for all branches and redundancy values at once.

Seven joints leave one degree of freedom at a pose of the hand. Once joint 7 is chosen, the wrist
is known, the triangle from shoulder over elbow to wrist gives joint 4, and the rest follows, with
two choices each at the elbow, the wrist and the shoulder. The geometry is that of

Y. He, S. Liu: Analytical Inverse Kinematics for Franka Emika Panda, ICCMA 2021,
https://doi.org/10.1109/ICCMA54375.2021.9646185
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from slap_ros.motion.joints import (
    HIGH,
    LOW,
    Array,
    Free,
    Joints,
    control_steps,
    within_limits,
)
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, matrix
from slap_ros.motion.numpy_kinematics import product
from slap_ros.portable_math import PI, arccos, arctan2, sin_cos
from slap_ros.worlds.panda import JOINTS

SHOULDER = np.array([0.0, 0.0, 0.333])  # m, where the axes of joints 1, 2 and 3 meet
UPPER_ARM, FOREARM = 0.316, 0.384  # m, along the axes of joints 3 and 5
ELBOW = 0.0825  # m, from both of these axes to that of joint 4
WRIST = 0.088  # m, from the axes of joints 5 and 6 to that of joint 7
BRANCHES = 8  # elbow, wrist, shoulder
# The law of cosines at the elbow: (SIDES2 - distance²) / ELBOW_SCALE is the cosine of joint 4 from
# its middle between both ways to bend.
_SINE, _COSINE = ELBOW * (UPPER_ARM + FOREARM), ELBOW**2 - UPPER_ARM * FOREARM
SIDES2 = UPPER_ARM**2 + FOREARM**2 + 2.0 * ELBOW**2  # m²
ELBOW_SCALE = 2.0 * math.sqrt(_SINE * _SINE + _COSINE * _COSINE)  # m²
ELBOW_MIDDLE = float(arctan2(np.array(_SINE), np.array(_COSINE)))  # rad

SWEEP = 64  # values of joint 7 over its range
SPACING = (HIGH[6] - LOW[6]) / (SWEEP - 1)  # rad, between two of them
AROUND = np.linspace(-SPACING, SPACING, 33)  # rad, from the best of the sweep
_SWEPT = np.linspace(LOW[6], HIGH[6], SWEEP)  # rad
_FREE_BATCH = 16  # candidates that are checked for collisions together
UPRIGHT = 1e-9  # sine of joint 2, below which joints 1 and 3 turn about the same axis

TO_LAST_LINK = matrix(GRASP_IN_LAST_LINK.inverse())
_SIGNS = np.array([1.0, -1.0])


def nearest_configurations(targets: Array, near: Joints, free: Free) -> Joints:
    """The free configuration at each pose that is the fewest control steps away.

    Args:
        targets: Poses of the grasp point in the base's frame, as homogeneous transforms, lengths
            in m, shape (n, 4, 4).
        near: Configuration to be near to, rad, shape (7,).
        free: Checker of which configurations are free of collisions.

    Returns:
        rad, shape (n, 7); NaN where a pose is out of reach or no configuration there is free.
    """
    swept = solutions(targets, [sweep(near)] * len(targets), near)
    best = _first_free(swept, free)
    refined = solutions(targets, [_around(q) for q in best], near)
    nearer = [
        q[:0] if known is None else q[control_steps(near, q) < control_steps(near, known)]
        for q, known in zip(refined, best, strict=True)
    ]
    better = _first_free(nearer, free)
    chosen = [known if q is None else q for q, known in zip(better, best, strict=True)]
    nowhere = np.full(JOINTS, np.nan)
    rows = [nowhere if q is None else q for q in chosen]
    return np.array(rows).reshape(-1, JOINTS)


def sweep(near: Joints) -> Array:
    """Values of joint 7 over its range, and its present one: shape (SWEEP + 1,)."""
    return np.concatenate([_SWEPT, near[6:]])


def _around(best: Joints | None) -> Array:
    """Values of joint 7 between the neighbours of the best in the sweep; none without a best."""
    if best is None:
        return np.empty(0)
    return cast(Array, np.clip(best[6] + AROUND, LOW[6], HIGH[6]))


def solutions(targets: Array, joint7: Sequence[Array], near: Joints) -> list[Joints]:
    """The configurations at each pose within the limits, nearest first.

    Args:
        targets: Poses of the grasp point, as homogeneous transforms, shape (n, 4, 4).
        joint7: Values of joint 7 at each pose, rad.
        near: Configuration to be near to, rad, shape (7,).

    Returns:
        For each pose rad, shape (k, 7).
    """
    counts = [len(values) for values in joint7]
    frames = np.repeat(targets, counts, axis=0)
    branches = ik_branches(frames, np.concatenate([np.empty(0), *joint7]), near[0])
    found = np.split(branches, np.cumsum(counts)[:-1])
    return [_nearest_first(q[within_limits(q)], near) for q in found]


def _nearest_first(q: Joints, near: Joints) -> Joints:
    return q[np.argsort(control_steps(near, q), kind="stable")]


def _first_free(candidates: Sequence[Joints], free: Free) -> list[Joints | None]:
    """The first that is free in each of some arrays of the shape (k, 7), k from 0 on."""
    firsts = [q[:1] for q in candidates]
    # These alone first, and together: mostly they are free.
    allowed = iter(free(np.concatenate([np.empty((0, JOINTS)), *firsts])).tolist())
    firsts = [
        first if len(first) == 0 or next(allowed) else _next_free(q[1:], free)
        for first, q in zip(firsts, candidates, strict=True)
    ]
    return [first[0] if len(first) else None for first in firsts]


def _next_free(candidates: Joints, free: Free) -> Joints:
    """The first that is free, shape (1, 7), or none, shape (0, 7)."""
    for i in range(0, len(candidates), _FREE_BATCH):
        batch = candidates[i : i + _FREE_BATCH]
        found = batch[free(batch)]
        if len(found):
            return found[:1]
    return candidates[:0]


def ik_branches(targets: Array, joint7: Array, joint1: float = 0.0) -> Joints:
    """The configuration of every branch at each of many poses, joint 7 given.

    Args:
        targets: Poses of the grasp point in the base's frame, as homogeneous transforms, lengths
            in m, shape (m, 4, 4), or (1, 4, 4) for the same pose throughout.
        joint7: Values of joint 7, rad, shape (m,).
        joint1: Value of joint 1 where the upper arm is upright and joint 1 is free, rad.

    Returns:
        rad, shape (m, BRANCHES, 7), NaN where a branch does not reach; joint limits are not heeded.
    """
    # Axes are unit vectors of the base's frame; the frame of link i is named by i. Arrays have
    # the shape (m, elbow, wrist, shoulder) of the choices made so far, vectors 3 before it.
    last = product(targets, TO_LAST_LINK[None])
    last_x, last_y, last_z, origin = last[:, :3].transpose(2, 1, 0)[..., None, None, None]
    q7 = joint7[:, None, None, None]
    sin7, cos7 = sin_cos(q7)
    x6, y6, z6 = cos7 * last_x - sin7 * last_y, -last_z, sin7 * last_x + cos7 * last_y
    wrist = origin - WRIST * x6
    to_shoulder = SHOULDER[:, None, None, None, None] - wrist

    with np.errstate(invalid="ignore"):  # NaN: out of reach
        q4 = _elbow(_dot(to_shoulder, to_shoulder))
        sin4, cos4 = sin_cos(q4)
        # The same vector in the frame of link 4, where y is along the forearm.
        along_x = ELBOW * (1.0 - cos4) - UPPER_ARM * sin4
        along_y = ELBOW * sin4 - UPPER_ARM * cos4 - FOREARM

        shoulder_x, shoulder_y = _dot(to_shoulder, x6), _dot(to_shoulder, y6)
        slant = arccos(along_y / _length(shoulder_x, shoulder_y))
        q6 = arctan2(shoulder_x, shoulder_y) + slant * _SIGNS[:, None]
        sin6, cos6 = sin_cos(q6)
        q5 = arctan2(_dot(to_shoulder, z6), cos6 * shoulder_x - sin6 * shoulder_y)

        y4 = sin6 * x6 + cos6 * y6
        x4 = (to_shoulder - along_y * y4) / along_x
        x3, z3 = cos4 * x4 - sin4 * y4, sin4 * x4 + cos4 * y4
        y3_up = x4[1] * y4[0] - x4[0] * y4[1]
        q2 = arccos(np.clip(z3[2], -1.0, 1.0)) * _SIGNS
        q1 = arctan2(_SIGNS * z3[1], _SIGNS * z3[0])
        q3 = arctan2(_SIGNS * y3_up, -_SIGNS * x3[2])
        upright = _length(z3[0], z3[1]) < UPRIGHT
        q1 = np.where(upright, joint1, q1)
        q3 = np.where(upright, _wrap(arctan2(x3[1], x3[0]) - joint1, -PI), q3)

        parts = (q1, q2, q3, _wrap(q4, -2.0 * PI), q5, _wrap(q6, LOW[5]), q7)
    q: Joints = np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, BRANCHES, JOINTS)
    return q


def _elbow(distance2: Array) -> Array:
    """Joint 4 for a squared distance from shoulder to wrist: elbow out, elbow in."""
    swing = arccos((SIDES2 - distance2) / ELBOW_SCALE)
    return cast(Array, ELBOW_MIDDLE + swing * _SIGNS[:, None, None])


def _dot(a: Array, b: Array) -> Array:
    return cast(Array, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _length(x: Array, y: Array) -> Array:
    return cast(Array, np.sqrt(x * x + y * y))


def _wrap(angle: Array, low: float) -> Array:
    """The same angle in [low, low + 2 pi), from at most one turn beyond."""
    turn = 2.0 * PI
    return np.where(angle < low, angle + turn, np.where(angle >= low + turn, angle - turn, angle))
