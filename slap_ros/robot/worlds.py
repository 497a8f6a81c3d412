# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the ensemble can run in."""

SIM, ROBOT, MOCK = WORLDS = ("sim", "robot", "mock")  # mock: the bridge, a mock robot behind it
