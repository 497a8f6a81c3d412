# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a robot may be commanded to do in one control period."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidCommandError
from slap_ros.relational import Feature

Action = NDArray[np.float64]  # one entry per axis, the gripper last


@dataclass(frozen=True)
class ActionSpace:
    """The axes of an action. The last one is the gripper: > 0.5 closes, < -0.5 opens."""

    axes: tuple[Feature, ...]  # displacement a step in the axis' unit; the gripper is a pure number
    low: tuple[float, ...]
    high: tuple[float, ...]

    @cached_property
    def _bounds(self) -> tuple[Action, Action]:
        tolerance = 1e-9  # rounding of a displacement computed as a difference
        return np.array(self.low) - tolerance, np.array(self.high) + tolerance

    def check(self, action: Action) -> None:
        """Refuse what the robot must not do.

        Raises:
            InvalidCommandError: Wrong length, not finite, or out of range; names the axis.
        """
        low, high = self._bounds
        if action.shape != low.shape:
            raise InvalidCommandError(
                f"a command has {low.size} entries ({', '.join(a.name for a in self.axes)}), "
                f"got shape {action.shape}"
            )
        inside = (action >= low) & (action <= high)  # False for NaN too
        if not inside.all():
            i = int(np.argmin(inside))
            raise InvalidCommandError(
                f"command {self.axes[i].name} = {action[i]} {self.axes[i].unit} is not within "
                f"[{self.low[i]}, {self.high[i]}]"
            )
