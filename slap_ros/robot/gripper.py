# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a parallel gripper is told, and how far apart its fingers stand."""

from __future__ import annotations

from enum import Enum

from slap_ros.worlds.panda import FINGER_OPEN

GAP_OPEN = 2.0 * FINGER_OPEN  # m, between the fingers
GAP_SHUT = 0.0  # m


class GripperAction(Enum):
    """What the gripper does before the arm moves.

    Args:
        gap: Gap to which its fingers are told to move, m; None where they stay as they are.
    """

    KEEP = None
    CLOSE = GAP_SHUT
    OPEN = GAP_OPEN

    def __init__(self, gap: float | None) -> None:
        self.gap = gap
