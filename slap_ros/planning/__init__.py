# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract planning graph, search, and closed-loop execution."""
