# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compile motion planning ahead of its first use: ``python -m slap_ros.motion.kernels``."""

from slap_ros.motion.kernels.compiled_backend import CompiledBackend

CompiledBackend()
