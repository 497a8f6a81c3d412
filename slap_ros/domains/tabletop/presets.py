# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the arm may move in the presets ``fair`` and ``paper``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from slap_ros.core import ActionSpace
from slap_ros.domains.tabletop.timing import FixedStepTiming, SpeedLimitTiming, Timing
from slap_ros.physics.panda import JOINTS
from slap_ros.physics.world import ACTION_SPACE

# The reference does not limit its planned motions, which go up to 3 rad in a control step.
UNLIMITED_ACTION_SPACE = replace(
    ACTION_SPACE, low=(*(-math.pi,) * JOINTS, -1.0), high=(*(math.pi,) * JOINTS, 1.0)
)
ACTION_SPACES: Mapping[str, ActionSpace] = {"fair": ACTION_SPACE, "paper": UNLIMITED_ACTION_SPACE}
TIMINGS: Mapping[str, Timing] = {"fair": SpeedLimitTiming(), "paper": FixedStepTiming()}
