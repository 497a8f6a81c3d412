# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who may join in: whoever is on this host, unless the environment says otherwise."""

from __future__ import annotations

import os

REACH = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def stay_on_this_host() -> None:
    """Before ``rclpy.init``: a robot takes no commands from elsewhere by accident.

    Left to itself Jazzy looks for others on the whole subnet. Who wants that sets ``REACH``.
    """
    os.environ.setdefault(REACH, "LOCALHOST")
