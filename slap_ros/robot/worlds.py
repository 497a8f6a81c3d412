# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the ensemble can run in."""

# mock: the bridge, with a mock robot behind it; mujoco: the bridge, with a robot in MuJoCo behind it
SIM, ROBOT, MOCK, MUJOCO = WORLDS = ("sim", "robot", "mock", "mujoco")
