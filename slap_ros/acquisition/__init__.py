# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""LG-SAIL: ``proposals`` of operators and rewards, ``training`` of skills, and the ``curriculum``.

The curriculum imports both others; proposals and training do not import one another.
"""
