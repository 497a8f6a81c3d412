# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics of many configurations at once, in numpy.

Sums are written out, so that their bits are those of the compiled kernels on every processor.
"""

from __future__ import annotations

import numpy as np

from slap_ros.motion.joints import Array, Joints
from slap_ros.motion.kinematics import AT_ZERO
from slap_ros.portable_math import sin_cos
from slap_ros.worlds.panda import JOINTS

# A joint's frame at zero, times a rotation by the joint about z, is C cos + S sin + FIXED.
_COS, _SIN, _FIXED = np.zeros((3, JOINTS, 4, 4))
_COS[..., 0], _COS[..., 1] = AT_ZERO[..., 0], AT_ZERO[..., 1]
_SIN[..., 0], _SIN[..., 1] = AT_ZERO[..., 1], -AT_ZERO[..., 0]
_FIXED[..., 2:] = AT_ZERO[..., 2:]


def arm_frames(q: Joints) -> Array:
    """Where link 1 to link 7 are; see :func:`slap_ros.motion.kinematics.arm_frames`."""
    sine, cosine = sin_cos(q[..., None, None])
    frames = cosine * _COS + sine * _SIN + _FIXED
    for joint in range(1, JOINTS):
        frames[:, joint] = product(frames[:, joint - 1], frames[:, joint])
    return frames


def product(a: Array, b: Array) -> Array:
    """The products of homogeneous transforms: shapes (n, 4, 4)."""
    result = a[:, :, 0, None] * b[:, None, 0]
    for k in range(1, 4):
        result += a[:, :, k, None] * b[:, None, k]
    return result
