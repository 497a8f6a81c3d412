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

from typing import cast

import numpy as np

from slap_ros.motion.joints import (
    HIGH,
    LOW,
    Array,
    Free,
    Joints,
    configuration,
    control_steps,
    within_limits,
)
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, matrix
from slap_ros.physics.panda import JOINTS, Pose

SHOULDER = np.array([0.0, 0.0, 0.333])  # m, where the axes of joints 1, 2 and 3 meet
UPPER_ARM, FOREARM = 0.316, 0.384  # m, along the axes of joints 3 and 5
ELBOW = 0.0825  # m, from both of these axes to that of joint 4
WRIST = 0.088  # m, from the axes of joints 5 and 6 to that of joint 7

SWEEP = 256  # values of joint 7 over its range
REFINEMENT = 17  # values around the best of the sweep
_FREE_BATCH = 16  # candidates that are checked for collisions together
_UPRIGHT = 1e-9  # sine of joint 2, below which joints 1 and 3 turn about the same axis

_TO_LAST_LINK = np.linalg.inv(matrix(GRASP_IN_LAST_LINK))
_SIGNS = np.array([1.0, -1.0])


def inverse_kinematics(target: Pose, near: Joints, *, free: Free | None = None) -> Joints | None:
    """The free configuration at a pose that is the fewest control steps away.

    Exact to rounding in the pose; over the redundancy it is the nearest of a sweep that is refined
    around its best. Deterministic.

    Args:
        target: Pose of the grasp point in the base's frame.
        near: Configuration to be near to, rad, shape (7,).
        free: Which configurations are free of collisions; all, if None.

    Returns:
        rad, shape (7,); None if the pose is out of reach or no configuration there is free.
    """
    near = configuration(near)
    best = _first_free(ik_candidates(target, near), free)
    if best is None:
        return None
    spacing = (HIGH[6] - LOW[6]) / SWEEP
    around = np.clip(best[6] + np.linspace(-spacing, spacing, REFINEMENT), LOW[6], HIGH[6])
    refined = _nearest_first(ik_solutions(target, around, near[0]), near)
    refined = refined[control_steps(near, refined) < control_steps(near, best)]
    better = _first_free(refined, free)
    return best if better is None else better


def ik_candidates(target: Pose, near: Joints) -> Joints:
    """Configurations at a pose, over all branches and redundancy values, the nearest first.

    Args:
        target: Pose of the grasp point in the base's frame.
        near: rad, shape (7,).

    Returns:
        rad, shape (k, 7); k is 0 if the pose is out of reach.
    """
    sweep = np.append(np.linspace(LOW[6], HIGH[6], SWEEP), near[6])
    return _nearest_first(ik_solutions(target, sweep, near[0]), near)


def _nearest_first(q: Joints, near: Joints) -> Joints:
    return q[np.argsort(control_steps(near, q), kind="stable")]


def _first_free(candidates: Joints, free: Free | None) -> Joints | None:
    # The nearest alone first: mostly it is free.
    for batch in np.split(candidates, range(1, len(candidates), _FREE_BATCH)):
        allowed = np.ones(len(batch), bool) if free is None else free(batch)
        if allowed.any():
            return cast(Joints, batch[np.argmax(allowed)])
    return None


def ik_solutions(target: Pose, joint7: Array, joint1: float = 0.0) -> Joints:
    """All configurations at a pose with one of the given values of joint 7.

    Args:
        target: Pose of the grasp point in the base's frame.
        joint7: rad, shape (m,).
        joint1: rad; taken where the upper arm is upright and joint 1 is free.

    Returns:
        rad, shape (k, 7), within the limits.
    """
    # Axes are unit vectors of the base's frame; the frame of link i is named by i. Arrays have
    # the shape (m, elbow, wrist, shoulder) of the choices made so far, vectors 3 before it.
    last = matrix(target) @ _TO_LAST_LINK
    last_x, last_y, last_z = last[:3, :3].T[:, :, None, None, None, None]
    q7 = joint7[:, None, None, None]
    cos7, sin7 = np.cos(q7), np.sin(q7)
    x6, y6, z6 = cos7 * last_x - sin7 * last_y, -last_z, sin7 * last_x + cos7 * last_y
    wrist = last[:3, 3][:, None, None, None, None] - WRIST * x6
    to_shoulder = SHOULDER[:, None, None, None, None] - wrist

    with np.errstate(invalid="ignore"):  # NaN: out of reach
        q4 = _elbow(_dot(to_shoulder, to_shoulder))
        cos4, sin4 = np.cos(q4), np.sin(q4)
        # The same vector in the frame of link 4, where y is along the forearm.
        along_x = ELBOW * (1.0 - cos4) - UPPER_ARM * sin4
        along_y = ELBOW * sin4 - UPPER_ARM * cos4 - FOREARM

        shoulder_x, shoulder_y = _dot(to_shoulder, x6), _dot(to_shoulder, y6)
        slant = np.arccos(along_y / np.hypot(shoulder_x, shoulder_y))
        q6 = np.arctan2(shoulder_x, shoulder_y) + slant * _SIGNS[:, None]
        cos6, sin6 = np.cos(q6), np.sin(q6)
        q5 = np.arctan2(_dot(to_shoulder, z6), cos6 * shoulder_x - sin6 * shoulder_y)

        y4 = sin6 * x6 + cos6 * y6
        x4 = (to_shoulder - along_y * y4) / along_x
        x3, z3 = cos4 * x4 - sin4 * y4, sin4 * x4 + cos4 * y4
        y3_up = x4[1] * y4[0] - x4[0] * y4[1]
        q2 = np.arccos(np.clip(z3[2], -1.0, 1.0)) * _SIGNS
        q1 = np.arctan2(_SIGNS * z3[1], _SIGNS * z3[0])
        q3 = np.arctan2(_SIGNS * y3_up, -_SIGNS * x3[2])
        upright = np.hypot(z3[0], z3[1]) < _UPRIGHT
        q1 = np.where(upright, joint1, q1)
        q3 = np.where(upright, _wrap(np.arctan2(x3[1], x3[0]) - joint1, -np.pi), q3)

        parts = (q1, q2, q3, _wrap(q4, -2.0 * np.pi), q5, _wrap(q6, LOW[5]), q7)
    q: Joints = np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, JOINTS)
    return q[within_limits(q)]


def _elbow(distance2: Array) -> Array:
    """Joint 4 for a squared distance from shoulder to wrist: elbow out, elbow in."""
    sine = ELBOW * (UPPER_ARM + FOREARM)
    cosine = ELBOW**2 - UPPER_ARM * FOREARM
    sides2 = UPPER_ARM**2 + FOREARM**2 + 2.0 * ELBOW**2
    swing = np.arccos((sides2 - distance2) / (2.0 * np.hypot(sine, cosine)))
    return cast(Array, np.arctan2(sine, cosine) + swing * _SIGNS[:, None, None])


def _dot(a: Array, b: Array) -> Array:
    return cast(Array, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _wrap(angle: Array, low: float) -> Array:
    """The same angle in [low, low + 2 pi)."""
    return np.mod(angle - low, 2.0 * np.pi) + low
