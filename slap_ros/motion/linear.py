# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Straight motion of the grasp point: approach and retract."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.geometry.pose import ORIGIN, Pose, Vector, conjugate, multiply
from slap_ros.motion.backend import backend
from slap_ros.motion.free_space import free_space
from slap_ros.motion.joints import (
    RESOLUTION,
    STEP,
    Free,
    Joints,
    Path,
    configuration,
    control_steps,
    within_limits,
)
from slap_ros.worlds.panda import GraspKinematics, grasp_pose

INCREMENT = 0.0125  # m, between rows of the path: coming down, less than 1 mm off the line
TURN_INCREMENT = 0.05  # rad
HALVINGS = 2  # of an increment
ITERATIONS = 8  # of Newton's method, an increment; 3 or 4 are usual
CLOSE = 1e-7  # m and rad
DAMPING = 1e-4  # m and rad a control step, against singularities
_DAMPED = DAMPING**2 * np.eye(6)
LARGEST_JUMP = 2.0  # control steps an increment; more is another branch


def shifted(pose: Pose, displacement: tuple[float, float, float]) -> Pose:
    """The pose moved by a displacement in m, along the axes of the base."""
    x, y, z = (a + b for a, b in zip(pose.position, displacement, strict=True))
    return Pose((x, y, z), pose.quaternion)


def linear_motion(q: Joints, target: Pose, *, free: Free | None = None) -> Path | None:
    """The path on which the grasp point goes straight to a pose, turning evenly.

    Every increment continues from the one before along the Jacobian, by the fewest control steps,
    so that the arm stays in its branch; where it is too long for that, it is halved.

    Args:
        q: Configuration to start from, rad, shape (7,).
        target: Pose of the grasp point in the base's frame.
        free: Checker of which configurations are free of collisions; None: all are.

    Returns:
        rad, shape (k, 7), beginning with ``q``; None if it would leave the joint limits, come to a
        singularity, or collide.
    """
    q = configuration(q)
    start = grasp_pose(q)
    parts = (math.dist(start.position, target.position) / INCREMENT, _angle(start, target))
    count = max(1, math.ceil(max(parts) - 1e-9))
    rows = backend().linear_rows(q, start, target, count)
    if rows is None or (free is not None and not free_space(free).path_is_free(rows, RESOLUTION)):
        return None
    return rows


def linear_rows(q: Joints, start: Pose, target: Pose, count: int) -> Path | None:
    """The path of :func:`linear_motion`, whatever is in its way, by Python.

    Args:
        q: Configuration to start from, rad, shape (7,).
        start: Pose of the grasp point there.
        target: Pose of the grasp point in the base's frame.
        count: Number of increments.
    """
    path = [q]
    for i in range(1, count + 1):
        following = _rows(path[-1], start, target, ((i - 1) / count, i / count), HALVINGS)
        if following is None:
            return None
        path += following
    return np.stack(path)


def _angle(start: Pose, target: Pose) -> float:
    """The turn between two poses in increments."""
    return start.angle_to(target) / TURN_INCREMENT


def _on_the_way(start: Pose, target: Pose, fraction: float) -> Pose:
    x, y, z = (a + fraction * (b - a) for a, b in zip(start.position, target.position, strict=True))
    turn = [fraction * part for part in rotation_vector(start, target)]
    angle = math.sqrt(sum(part * part for part in turn))
    ax, ay, az = (part * (math.sin(0.5 * angle) / angle if angle else 0.5) for part in turn)
    turned = Pose((0.0, 0.0, 0.0), (ax, ay, az, math.cos(0.5 * angle)))
    return Pose((x, y, z), turned.compose(Pose((0.0, 0.0, 0.0), start.quaternion)).quaternion)


def rotation_vector(start: Pose, target: Pose) -> Vector:
    """The turn from one orientation to another, rad, along the axes of the base."""
    x, y, z, w = multiply(target.quaternion, conjugate(start.quaternion))
    sine = math.hypot(x, y, z)
    if sine == 0.0:
        return ORIGIN
    # The shorter of the two ways round.
    angle = 2.0 * math.atan2(sine, abs(w)) * (1.0 if w >= 0.0 else -1.0)
    return x * (angle / sine), y * (angle / sine), z * (angle / sine)


def _rows(
    q: Joints, start: Pose, target: Pose, part: tuple[float, float], halvings: int
) -> list[Joints] | None:
    """The rows of a part of the way behind ``q``: one if that does, else those of both halves.

    Args:
        q: Configuration at which the part begins, rad, shape (7,).
        start: Pose where the whole way begins.
        target: Pose where the whole way ends.
        part: Fractions of the way, from and to.
        halvings: Largest number of times that the part may be halved.
    """
    begin, end = part
    following = _follow(q, _on_the_way(start, target, end))
    if following is not None:
        return [following]
    if halvings == 0:
        return None
    middle = 0.5 * (begin + end)
    first = _rows(q, start, target, (begin, middle), halvings - 1)
    if first is None:
        return None
    second = _rows(first[-1], start, target, (middle, end), halvings - 1)
    return None if second is None else first + second


def _follow(q: Joints, target: Pose) -> Joints | None:
    """The configuration at a nearby pose, by Newton's method in units of control steps."""
    before = q
    for _ in range(ITERATIONS):
        reach = GraspKinematics(q.tolist())
        offset = (a - b for a, b in zip(target.position, reach.grasp.position, strict=True))
        error = (*offset, *rotation_vector(reach.grasp, target))
        if max(map(abs, error)) < CLOSE:
            close = control_steps(before, q) <= LARGEST_JUMP
            return q if close and within_limits(q) else None
        scaled = reach.jacobian() * STEP
        damped = scaled @ scaled.T + _DAMPED
        q = q + STEP * (scaled.T @ np.linalg.solve(damped, error))
    return None
