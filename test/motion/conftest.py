# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tests of motion begin once it is compiled, which may take longer than a test may."""

from slap_ros.motion.backend import backend

backend()
