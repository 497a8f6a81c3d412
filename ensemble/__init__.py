# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes share: names and QoS, conversions, parameters, entry points, runs of them all."""
