# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics, as :mod:`slap_ros.motion.numpy_kinematics`."""

from __future__ import annotations

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kernels.trigonometry import sin_cos
from slap_ros.motion.kinematics import AT_ZERO
from slap_ros.worlds.panda import JOINTS


@inner
def place_links(q: Joints, frames: Array) -> None:
    """Write where link 1 to link 7 are.

    Args:
        q: Joint positions, rad, shape (7,).
        frames: Homogeneous transforms without their last rows, lengths in m, shape (7, 3, 4) or
            more rows; overwritten.
    """
    for joint in range(JOINTS):
        sine, cosine = sin_cos(q[joint])
        zero = AT_ZERO[joint]
        for row in range(3):
            x, y = zero[row, 0], zero[row, 1]
            frames[joint, row, 0] = cosine * x + sine * y
            frames[joint, row, 1] = cosine * y + sine * -x
            frames[joint, row, 2] = zero[row, 2]
            frames[joint, row, 3] = zero[row, 3]
        if joint > 0:
            _compose(frames[joint - 1], frames[joint])


@inner
def _compose(outer: Array, frame: Array) -> None:
    """Turn a frame that is given in another into one that is given where the other is."""
    for column in range(4):
        x, y, z = frame[0, column], frame[1, column], frame[2, column]
        for row in range(3):
            seen = outer[row, 0] * x + outer[row, 1] * y + outer[row, 2] * z
            frame[row, column] = seen + outer[row, 3] if column == 3 else seen


@compiled
def arm_frames(q: Joints) -> Array:
    """Where link 1 to link 7 are: shape (n, 7) to (n, 7, 4, 4)."""
    frames = np.zeros((len(q), JOINTS, 4, 4))
    for i in range(len(q)):
        place_links(q[i], frames[i])
        frames[i, :, 3, 3] = 1.0
    return frames
