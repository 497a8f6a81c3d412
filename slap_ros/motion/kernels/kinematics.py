# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics, as :mod:`slap_ros.motion.numpy_kinematics`."""

from __future__ import annotations

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.geometry.pose import Vector
from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kernels.trigonometry import sin_cos
from slap_ros.motion.kernels.vectors import Matrix, applied, matrix, total, transposed, vector
from slap_ros.motion.kinematics import AT_ZERO
from slap_ros.worlds.panda import JOINTS

Frame = tuple[Matrix, Vector]  # orientation and origin
IDENTITY: Frame = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0)


@inner
def place_links(q: Joints, frames: Array) -> None:
    """Write where link 1 to link 7 are.

    Args:
        q: Joint positions, rad, shape (7,).
        frames: Homogeneous transforms without their last rows, lengths in m, shape (7, 3, 4) or
            more rows; overwritten.
    """
    outer = IDENTITY
    for joint in range(JOINTS):
        sine, cosine = sin_cos(q[joint])
        frame = _turned(matrix(AT_ZERO[joint]), vector(AT_ZERO[joint, :, 3]), sine, cosine)
        if joint > 0:
            frame = _composed(outer, frame)
        outer = frame
        for row in range(3):
            (frames[joint, row, 0], frames[joint, row, 1], frames[joint, row, 2]) = frame[0][row]
            frames[joint, row, 3] = frame[1][row]


@inner
def _turned(zero: Matrix, origin: Vector, sine: float, cosine: float) -> Frame:
    """The frame of a joint that is turned about its own z axis."""
    return (
        _turned_row(zero[0], sine, cosine),
        _turned_row(zero[1], sine, cosine),
        _turned_row(zero[2], sine, cosine),
    ), origin


@inner
def _turned_row(row: Vector, sine: float, cosine: float) -> Vector:
    x, y, z = row
    return cosine * x + sine * y, cosine * y + sine * -x, z


@inner
def _composed(outer: Frame, frame: Frame) -> Frame:
    """A frame that is given in another, as it is where the other is."""
    (first, second, third), (turn, origin) = transposed(frame[0]), outer
    columns = applied(turn, first), applied(turn, second), applied(turn, third)
    return transposed(columns), total(applied(turn, frame[1]), origin)


@compiled
def arm_frames(q: Joints) -> Array:
    """Where link 1 to link 7 are: shape (n, 7) to (n, 7, 4, 4)."""
    frames = np.zeros((len(q), JOINTS, 4, 4))
    for i in range(len(q)):
        place_links(q[i], frames[i])
        frames[i, :, 3, 3] = 1.0
    return frames
