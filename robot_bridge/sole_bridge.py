# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One bridge alone may command an arm."""

from __future__ import annotations

from rclpy.node import Node

from ensemble.robot_parameters import BRIDGES
from slap_ros.errors import AlreadyRunningError


def require_alone(node: Node) -> None:
    """Refuse to begin beside another bridge: both would command the arm.

    Args:
        node: Bridge that is to begin.

    Raises:
        AlreadyRunningError: There is another one, or one was killed a moment ago.
    """
    own, space = node.get_name(), node.get_namespace()
    running = node.get_node_names_and_namespaces()
    for name in sorted(BRIDGES):
        if running.count((name, space)) > (name == own):
            raise AlreadyRunningError(
                f"another {name} runs in {space}, and one of them only may command the arm: stop "
                "the other one"
            )
