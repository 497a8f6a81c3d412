# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joining the network: whoever is on this host, unless the environment says otherwise."""

from __future__ import annotations

import os
from typing import Any

import rclpy

from slap_ros.errors import InvalidParameterError

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def join_network(**options: Any) -> None:
    """``rclpy.init``, so that a robot takes no commands from elsewhere by accident.

    Left to itself Jazzy looks for others on the whole subnet. Whoever wants that sets the variable
    ``ROS_AUTOMATIC_DISCOVERY_RANGE``.

    Raises:
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
    """
    os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST")
    try:
        rclpy.init(**options)
    except ValueError as error:
        raise InvalidParameterError(str(error)) from error
