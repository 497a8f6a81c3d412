# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the arm may move: settings of every preset on a table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from slap_ros.core import ActionSpace
from slap_ros.domains.tabletop.timing import FixedStepTiming, SpeedLimitTiming, Timing
from slap_ros.domains.variation import TaskSettings
from slap_ros.worlds.joint_space.world import ACTION_SPACE
from slap_ros.worlds.panda import JOINTS, MAX_STEP

# The reference does not limit its planned motions, which go up to 3 rad in a control step.
UNLIMITED_ACTION_SPACE = replace(
    ACTION_SPACE, low=(*(-math.pi,) * JOINTS, -1.0), high=(*(math.pi,) * JOINTS, 1.0)
)
ACTION_SPACES: Mapping[str, ActionSpace] = {"limit": ACTION_SPACE, "tens": UNLIMITED_ACTION_SPACE}
TIMINGS: Mapping[str, Timing] = {"limit": SpeedLimitTiming(), "tens": FixedStepTiming()}
ARM_LIMITS = {"shortcut_speed": (0.01, 1.0)}


@dataclass(frozen=True, kw_only=True)
class ArmSettings(TaskSettings):
    """Tasks on a table, and how the arm may move in them.

    Args:
        timing: Timing of given skills. ``limit``: as fast as the joints may move. ``tens``: the
            paper's, in multiples of ten control steps, at any speed.
        shortcut_speed: Highest speed of the joints in shortcuts, as a share of their speed limit.
    """

    limits: ClassVar = ARM_LIMITS
    choices: ClassVar = {"timing": tuple(TIMINGS)}

    timing: str = "limit"
    shortcut_speed: float = 1.0

    @property
    def actions(self) -> ActionSpace:
        """What the world lets the arm do in a control step."""
        return ACTION_SPACES[self.timing]

    @property
    def learned_actions(self) -> ActionSpace:
        """What shortcuts may do of it."""
        steps = tuple(self.shortcut_speed * step for step in MAX_STEP)
        return replace(ACTION_SPACE, low=(*(-s for s in steps), -1.0), high=(*steps, 1.0))
