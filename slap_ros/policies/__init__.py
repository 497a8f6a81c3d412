# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Policies that run without torch: networks on a grid, their actions, and their files."""
