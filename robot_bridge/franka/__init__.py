# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Franka arm driven by its own protocol, or a simulated FR3 that speaks it."""
