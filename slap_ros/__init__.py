# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""slap_ros: abstract planning with learned shortcuts. The core; it imports no ROS."""

__version__ = "0.2.0"
