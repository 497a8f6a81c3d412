# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show: bodies as markers and frames, the arm as joint states."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node

from ensemble import encode
from ensemble.endpoints import advertise
from ensemble.interfaces import JOINT_STATES, MARKERS, TF
from slap_ros.core import Domain
from slap_ros.relational import State


class Visualizer:
    """Publishes each state for people to look at."""

    def __init__(self, node: Node, domain: Domain) -> None:
        """Publish as ``node``."""
        self._domain = domain
        self._markers = advertise(node, MARKERS)
        self._frames = node.create_publisher(TF.type, TF.name, TF.qos)
        self._joints = node.create_publisher(JOINT_STATES.type, JOINT_STATES.name, JOINT_STATES.qos)

    def show(self, state: State, stamp: Time) -> None:
        """Publish a state."""
        shown = encode.SCENE.shown(self._domain.display, state, stamp)
        self._markers.publish(shown.markers)
        self._frames.publish(shown.frames)
        if shown.joints.name:
            self._joints.publish(shown.joints)
