# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2's wire conventions over CycloneDDS: what rmw_cyclonedds is to a real rclpy."""
