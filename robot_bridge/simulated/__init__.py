# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What robots that are simulated share: sensors with noise, loss and delay."""
