# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot at a bench, commanded in each control period while it moves."""
