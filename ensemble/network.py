# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joining the network: nodes on this host only, unless the environment is set otherwise."""

from __future__ import annotations

import os
from typing import Any

import rclpy

from slap_ros.errors import InvalidParameterError

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def join_network(**options: Any) -> None:
    """``rclpy.init``, so that a robot takes no commands from elsewhere by accident.

    By default Jazzy discovers nodes on the whole subnet. To have that, set the variable
    ``ROS_AUTOMATIC_DISCOVERY_RANGE``.

    Raises:
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
    """
    os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST")
    try:
        rclpy.init(**options)
    except ValueError as error:
        raise InvalidParameterError(str(error)) from error
