# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cameras and AprilTags: what tags look like, and where the ones in a picture are.

Read ``pinhole_camera``, ``tags``, then ``tag_detection``. Nothing here knows robots or ROS.
"""
