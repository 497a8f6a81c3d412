# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics of many configurations at once, from the Panda's own joint frames."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from slap_ros.geometry.pose import Pose, rotation_matrix
from slap_ros.motion.backend import backend
from slap_ros.motion.joints import Array, Joints
from slap_ros.worlds.panda import JOINTS, grasp_pose, link_poses

LAST_LINK = JOINTS  # link 7, which carries the hand


def matrix(pose: Pose) -> Array:
    """The pose as a homogeneous transform, shape (4, 4), lengths in m."""
    rows = zip(rotation_matrix(pose.quaternion), pose.position, strict=True)
    return np.array([*((*turn, place) for turn, place in rows), (0.0, 0.0, 0.0, 1.0)])


_ZERO = link_poses((0.0,) * JOINTS, 0.0)
GRASP_IN_LAST_LINK = _ZERO[LAST_LINK].inverse().compose(grasp_pose((0.0,) * JOINTS))
# Frames of the joints at zero, each in the link before it: shape (7, 4, 4).
AT_ZERO = np.stack([matrix(a.inverse().compose(b)) for a, b in pairwise(_ZERO[: JOINTS + 1])])


def arm_frames(q: Joints) -> Array:
    """Where link 1 to link 7 are, in the base's frame.

    Args:
        q: Joint positions, rad, shape (n, 7).

    Returns:
        Homogeneous transforms, shape (n, 7, 4, 4), lengths in m.
    """
    return backend().arm_frames(np.ascontiguousarray(q, dtype=np.float64))
