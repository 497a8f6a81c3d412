# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong on the wire, by rclpy's names."""

from __future__ import annotations


class RCLError(RuntimeError):
    """The environment, or CycloneDDS, does not allow it; the message says what and why."""


class InvalidHandle(RCLError):
    """An endpoint was used after it, or its context, was shut down."""


class PublishTimeoutError(RCLError):
    """A reliable writer with a full history was blocked longer than it may block."""


class UnknownROSArgsError(RuntimeError):
    """Arguments after ``--ros-args`` that ROS 2 does not have."""


class RCLInvalidROSArgsError(RCLError):
    """Arguments after ``--ros-args`` that lack their value, or are malformed."""
