# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What no state of any world may have, and whether bodies are inside one another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from slap_ros.errors import InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW

UNIT_TOLERANCE = 1e-6  # 1, of a quaternion's length
LIMIT_TOLERANCE = 1e-9  # rad


def require_rotations(poses: Iterable[tuple[str, Pose]]) -> None:
    """Refuse poses whose quaternions are not rotations.

    Args:
        poses: Name of each body, and its pose.

    Raises:
        InvalidStateError: A quaternion is not normalised.
    """
    for name, pose in poses:
        length = math.hypot(*pose.quaternion)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise InvalidStateError(f"the quaternion of {name} has length {length}, not 1")


def require_joints_within_limits(joints: Sequence[float]) -> None:
    """Refuse a configuration that the arm cannot have.

    Args:
        joints: Positions of the joints, rad, shape (7,).

    Raises:
        InvalidStateError: A joint is beyond its limits.
    """
    for i, (low, q, high) in enumerate(zip(JOINT_LOW, joints, JOINT_HIGH, strict=True)):
        if not low - LIMIT_TOLERANCE <= q <= high + LIMIT_TOLERANCE:
            raise InvalidStateError(f"joint {i + 1} = {q} rad is not within [{low}, {high}]")


def share_space(some: Sequence[OrientedBox], others: Sequence[OrientedBox]) -> bool:
    """Whether any of some boxes overlaps any of others."""
    return any(
        other.near(box.pose.position, box.radius) and other.overlaps(box)
        for box in some
        for other in others
    )
