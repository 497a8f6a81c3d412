# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of slap_msgs without ROS: definitions, shapes, and conversion to core objects."""
