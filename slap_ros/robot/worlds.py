# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the ensemble can run in."""

# mock, mujoco: the bridge, with a simulated robot behind it
SIM, ROBOT, MOCK, MUJOCO = WORLDS = ("sim", "robot", "mock", "mujoco")
