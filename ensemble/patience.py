# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much longer than usual to wait: a factor of all deadlines. Imported without ROS."""

IMPATIENT, PATIENT = 0.01, 1e4  # the least and the most
