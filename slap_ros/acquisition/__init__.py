# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""LG-SAIL: operators and rewards that are proposed and checked, and skills learned from them."""
