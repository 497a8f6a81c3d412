# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rclpy's API over CycloneDDS, for machines without ROS 2.

Nothing is imported from here in ordinary use: once installed, ``import rclpy`` and
``from std_msgs.msg import String`` work (see :mod:`embedded_ros.finder`), unless a real ROS 2
is on the path, which then wins.

This module stays empty because it is imported at every interpreter start.
"""

__version__ = "0.2.0"
