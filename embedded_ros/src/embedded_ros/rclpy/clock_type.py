# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kinds of clocks."""

from __future__ import annotations

from enum import IntEnum


class ClockType(IntEnum):
    """What a clock follows: ROS time may be simulated, steady time never jumps."""

    ROS_TIME = 1
    SYSTEM_TIME = 2
    STEADY_TIME = 3
