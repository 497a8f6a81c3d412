# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A real arm in the world's place, without ROS: limits, measurements, the state made of them."""
