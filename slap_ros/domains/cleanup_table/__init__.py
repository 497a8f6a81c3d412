# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: toys and a wiper from the table into a bin (SLAP §5)."""
