# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot in MuJoCo, with the interfaces of a real one and nothing of the planner's physics."""
