# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The text of slap_msgs' interfaces, for reading bags and for embedded_ros where ROS 2 is not."""
