# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics of many configurations at once, from the Panda's own joint frames."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from slap_ros.geometry.pose import Pose, rotation_matrix
from slap_ros.motion.joints import Array, Joints
from slap_ros.worlds.panda import JOINTS, grasp_pose, link_poses

LAST_LINK = JOINTS  # link 7, which carries the hand


def matrix(pose: Pose) -> Array:
    """The pose as a homogeneous transform, shape (4, 4), lengths in m."""
    transform = np.eye(4)
    transform[:3, :3] = rotation_matrix(pose.quaternion)
    transform[:3, 3] = pose.position
    return transform


_ZERO = link_poses((0.0,) * JOINTS, 0.0)
GRASP_IN_LAST_LINK = _ZERO[LAST_LINK].inverse().compose(grasp_pose((0.0,) * JOINTS))

# A joint's frame at zero, times a rotation by the joint about z, is C cos + S sin + FIXED.
_AT_ZERO = np.stack([matrix(a.inverse().compose(b)) for a, b in pairwise(_ZERO[: JOINTS + 1])])
_COS, _SIN, _FIXED = np.zeros((3, JOINTS, 4, 4))
_COS[..., 0], _COS[..., 1] = _AT_ZERO[..., 0], _AT_ZERO[..., 1]
_SIN[..., 0], _SIN[..., 1] = _AT_ZERO[..., 1], -_AT_ZERO[..., 0]
_FIXED[..., 2:] = _AT_ZERO[..., 2:]


def arm_frames(q: Joints) -> Array:
    """Where link 1 to link 7 are, in the base's frame.

    Args:
        q: Joint positions, rad, shape (n, 7).

    Returns:
        Homogeneous transforms, shape (n, 7, 4, 4), lengths in m.
    """
    angles = q[..., None, None]
    frames: Array = np.cos(angles) * _COS + np.sin(angles) * _SIN + _FIXED
    for joint in range(1, JOINTS):
        np.matmul(frames[:, joint - 1], frames[:, joint], out=frames[:, joint])
    return frames
