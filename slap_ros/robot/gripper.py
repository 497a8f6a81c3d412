# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a parallel gripper is told, and how far apart its fingers stand."""

from __future__ import annotations

from enum import Enum

from slap_ros.worlds.panda import FINGER_OPEN

GAP_OPEN = 2.0 * FINGER_OPEN  # m, between the fingers
GAP_SHUT = 0.0  # m


class GripperAction(Enum):
    """What the gripper does before the arm moves."""

    KEEP = "keep"
    CLOSE = "close"
    OPEN = "open"
