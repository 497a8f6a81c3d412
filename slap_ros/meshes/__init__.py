# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shapes that are no boxes. Read on in this order: ``solid``, ``obj``, ``decomposition``."""
