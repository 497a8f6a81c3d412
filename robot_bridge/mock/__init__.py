# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A mock robot: controllers and detections of a simulated world, with latency and noise."""
