# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Straight motion of the grasp point, as the Python code of :mod:`slap_ros.motion.linear`.

Turns are matrices here and quaternions there, so that the last bits differ.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.joints import STEP, Array, Joints, Path
from slap_ros.motion.kernels.inverse_kinematics import is_within_limits
from slap_ros.motion.kernels.kinematics import place_links
from slap_ros.motion.kernels.lines import control_steps
from slap_ros.motion.kernels.trigonometry import arctan2, sin_cos
from slap_ros.motion.kernels.vectors import dot
from slap_ros.motion.kinematics import GRASP_IN_LAST_LINK, matrix
from slap_ros.motion.linear import CLOSE, DAMPING, HALVINGS, ITERATIONS, LARGEST_JUMP
from slap_ros.worlds.panda import JOINTS

_GRASP = matrix(GRASP_IN_LAST_LINK)
_ROWS = 6  # of the Jacobian


@compiled
def rows_to(q: Joints, start: Array, shift: Array, turn: Array, count: int) -> Path:
    """The path on which the grasp point goes straight, turning evenly.

    Args:
        q: Configuration to start from, rad, shape (7,).
        start: Pose of the grasp point there, as a homogeneous transform, shape (4, 4).
        shift: Displacement of the grasp point, m, shape (3,).
        turn: Rotation vector, rad, along the axes of the base, shape (3,).
        count: Number of increments.

    Returns:
        rad, shape (k, 7), beginning with ``q``; k is 0 where the arm cannot follow.
    """
    path, size = np.empty((count * 2**HALVINGS + 1, JOINTS)), 1
    path[0] = q
    for i in range(count):
        part, parts = 0, 1  # of this increment: where it has come to, and into how many it is cut
        while part < parts:
            fraction = (i + (part + 1) / parts) / count
            goal = _pose_on_way(start, shift, turn, fraction)
            if _follow(path[size - 1], goal, path[size]):
                size, part = size + 1, part + 1
                while part % 2 == 0 and parts > 1:
                    part, parts = part // 2, parts // 2
            elif parts == 2**HALVINGS:
                return path[:0].copy()
            else:
                part, parts = 2 * part, 2 * parts
    return path[:size].copy()


@inner
def _pose_on_way(start: Array, shift: Array, turn: Array, fraction: float) -> Array:
    """A pose on the way, as a homogeneous transform without its last row."""
    angle = fraction * math.sqrt(dot(turn, turn))
    sine, cosine = sin_cos(angle)
    axis = turn / max(math.sqrt(dot(turn, turn)), 1e-300)
    pose = np.empty((3, 4))
    for column in range(3):
        vector = start[:3, column]
        across = _cross(axis, vector)
        along = dot(axis, vector) * (1.0 - cosine)
        for row in range(3):
            pose[row, column] = cosine * vector[row] + sine * across[row] + along * axis[row]
    pose[:, 3] = start[:3, 3] + fraction * shift
    return pose


@inner
def _follow(before: Joints, goal: Array, q: Joints) -> bool:
    """Write the configuration at a nearby pose, by Newton's method; whether it is a good one."""
    frames, pose = np.empty((JOINTS, 3, 4)), np.empty((3, 4))
    scaled, error = np.empty((_ROWS, JOINTS)), np.empty(_ROWS)
    q[:] = before
    for _ in range(ITERATIONS):
        place_links(q, frames)
        _place_grasp(frames[JOINTS - 1], pose)
        _place_error(pose, goal, error)
        if np.abs(error).max() < CLOSE:
            return control_steps(before, q) <= LARGEST_JUMP and is_within_limits(q)
        for joint in range(JOINTS):
            axis = frames[joint, :, 2].copy()
            moved = _cross(axis, pose[:, 3] - frames[joint, :, 3])
            for row in range(3):
                scaled[row, joint] = moved[row] * STEP[joint]
                scaled[3 + row, joint] = axis[row] * STEP[joint]
        solution = _solved(scaled, error)
        for joint in range(JOINTS):
            step = 0.0
            for row in range(_ROWS):
                step += scaled[row, joint] * solution[row]
            q[joint] += STEP[joint] * step
    return False


@inner
def _place_grasp(link: Array, pose: Array) -> None:
    for row in range(3):
        for column in range(4):
            pose[row, column] = dot(link[row, :3], _GRASP[:3, column])
        pose[row, 3] += link[row, 3]


@inner
def _place_error(pose: Array, goal: Array, error: Array) -> None:
    """Write by how much, and about which vector, one pose must move to be another."""
    twist = np.zeros(3)  # twice the sine of the angle, along the axis
    trace = 0.0
    for column in range(3):
        twist += _cross(pose[:, column], goal[:, column])
        trace += dot(pose[:, column], goal[:, column])
    length = math.sqrt(dot(twist, twist))
    angle = arctan2(length, trace - 1.0)
    scale = angle / length if length > 0.0 else 0.5
    for row in range(3):
        error[row] = goal[row, 3] - pose[row, 3]
        error[3 + row] = twist[row] * scale


@inner
def _cross(a: Array, b: Array) -> Array:
    product = np.empty(3)
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
    return product


@inner
def _solved(scaled: Array, error: Array) -> Array:
    """The x of (S S' + damping²) x = error, by Cholesky's decomposition."""
    lower, x = np.zeros((_ROWS, _ROWS)), error.copy()
    for i in range(_ROWS):
        for j in range(i + 1):
            entry = DAMPING * DAMPING if i == j else 0.0
            for joint in range(JOINTS):
                entry += scaled[i, joint] * scaled[j, joint]
            for k in range(j):
                entry -= lower[i, k] * lower[j, k]
            lower[i, j] = math.sqrt(entry) if i == j else entry / lower[j, j]
    for i in range(_ROWS):
        for k in range(i):
            x[i] -= lower[i, k] * x[k]
        x[i] /= lower[i, i]
    for i in range(_ROWS - 1, -1, -1):
        for k in range(i + 1, _ROWS):
            x[i] -= lower[k, i] * x[k]
        x[i] /= lower[i, i]
    return x
