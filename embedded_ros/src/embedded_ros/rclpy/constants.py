# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Units."""

S_TO_NS = 1_000_000_000  # nanoseconds a second
