# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses as ROS messages."""

from __future__ import annotations

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3

from slap_ros.geometry.pose import Pose


def transform(pose: Pose, child: str) -> TransformStamped:
    """A pose as the transform of the frame ``child``."""
    x, y, z = pose.position
    qx, qy, qz, qw = pose.quaternion
    return TransformStamped(
        child_frame_id=child,
        transform=Transform(
            translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)
        ),
    )
