# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the ensemble can run in."""

# mock, mujoco, franka-sim: the bridge, with a simulated robot behind it
# franka: the bridge, and a driver that speaks the protocol of Franka's arms
SIM, ROBOT, MOCK, MUJOCO, FRANKA, FRANKA_SIM = WORLDS = (
    "sim",
    "robot",
    "mock",
    "mujoco",
    "franka",
    "franka-sim",
)
