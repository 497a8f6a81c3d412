# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a service or an action is asked, it answers."""

from __future__ import annotations

from traceback import format_exc

from rclpy.node import Node

from slap_ros.errors import InternalError, SlapError


def error_to_answer(node: Node, error: Exception) -> SlapError:
    """The error that goes into an answer. To be called where the error was caught.

    Args:
        node: Who answers. Its log gets the traceback of what nobody foresaw, for instance of a bug
            in another distribution's domain.
        error: What was raised.

    Returns:
        The error itself if it is one of slap_ros, or an InternalError.
    """
    if isinstance(error, SlapError):
        return error
    node.get_logger().error(format_exc())
    return InternalError(
        f"{type(error).__name__}: {error} (where it was raised is in the log of {node.get_name()})"
    )
