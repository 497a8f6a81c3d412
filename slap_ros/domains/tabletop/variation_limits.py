# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Between which numbers settings of tasks on a table are; a task may be impossible even so."""

import math

REACH = (-1.0, 1.0)  # m from the Panda's base, whose arm is 0.86 m long
TURN = (-math.pi, math.pi)  # rad
MATERIAL_LIMITS = {
    "mass": (0.001, 100.0),  # kg
    "friction": (0.0, 10.0),
}
