# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The errors that rclpy keeps in its compiled module of this name."""

from embedded_ros.transport.errors import (
    InvalidHandle,
    RCLError,
    RCLInvalidROSArgsError,
    UnknownROSArgsError,
)

__all__ = ["InvalidHandle", "RCLError", "RCLInvalidROSArgsError", "UnknownROSArgsError"]
