# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a robot may be commanded to do in one control period."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidCommandError, InvalidDomainError
from slap_ros.relational import Feature

Action = NDArray[np.float64]  # one entry per axis of the action space


@dataclass(frozen=True)
class GripperAxis:
    """The axis of an action that closes and opens a gripper; 0 leaves it as it is.

    Args:
        axis: Name of the gripper's axis.
        closes: Command that closes the gripper, in the axis' unit.
        opens: Command that opens the gripper, in the axis' unit.
    """

    axis: str
    closes: float = 1.0
    opens: float = -1.0


@dataclass(frozen=True)
class ActionSpace:
    """The axes of an action, and their ranges. An action of zeros moves nothing.

    Args:
        axes: Axes: each displacement in a step, in the axis' unit; the gripper's command in its
            domain's unit.
        low: The least entry of each axis, not above 0.
        high: The greatest entry of each axis, not below 0.
        gripper: Axis of the gripper; None: the robot has none.

    Raises:
        InvalidDomainError: The parts do not fit.
    """

    axes: tuple[Feature, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    gripper: GripperAxis | None = None

    def __post_init__(self) -> None:
        names = [axis.name for axis in self.axes]
        if not len(self.axes) == len(self.low) == len(self.high):
            raise InvalidDomainError(
                f"an action space with {len(self.axes)} axes ({', '.join(names)}) has "
                f"{len(self.low)} lower and {len(self.high)} upper limits"
            )
        for name, low, high in zip(names, self.low, self.high, strict=True):
            if not low <= 0.0 <= high:
                raise InvalidDomainError(
                    f"axis {name} of the action space: 0, which is to move nothing, is not within "
                    f"[{low}, {high}]"
                )
        if self.gripper is not None:
            self._check_gripper(self.gripper, names)

    def _check_gripper(self, gripper: GripperAxis, names: list[str]) -> None:
        if names.count(gripper.axis) != 1:
            raise InvalidDomainError(
                f"the gripper is to be the axis {gripper.axis!r}; there are {', '.join(names)}"
            )
        i = names.index(gripper.axis)
        inside = all(self.low[i] <= c <= self.high[i] for c in (gripper.closes, gripper.opens))
        if not inside or not gripper.closes * gripper.opens < 0.0:
            raise InvalidDomainError(
                f"axis {gripper.axis} closes the gripper at {gripper.closes} and opens it at "
                f"{gripper.opens}; one must be above 0 and the other below, both within "
                f"[{self.low[i]}, {self.high[i]}]"
            )

    @cached_property
    def _bounds(self) -> tuple[Action, Action]:
        tolerance = 1e-9  # rounding of a displacement computed as a difference
        return np.array(self.low) - tolerance, np.array(self.high) + tolerance

    @cached_property
    def gripper_index(self) -> int | None:
        """Which entry of an action commands the gripper; None without one."""
        if self.gripper is None:
            return None
        return [axis.name for axis in self.axes].index(self.gripper.axis)

    @cached_property
    def displacement_indices(self) -> tuple[int, ...]:
        """Which entries of an action are displacements: all but the gripper's."""
        return tuple(i for i in range(len(self.axes)) if i != self.gripper_index)

    @property
    def displacement_axes(self) -> tuple[Feature, ...]:
        """The axes that are displaced, without the gripper."""
        return tuple(self.axes[i] for i in self.displacement_indices)

    @property
    def hold(self) -> Action:
        """The action that moves nothing and leaves the gripper as it is."""
        return np.zeros(len(self.axes))

    def split(self, action: Action) -> tuple[Action, float]:
        """The displacements of an action, and its gripper command: 0 without a gripper."""
        command = 0.0 if self.gripper_index is None else float(action[self.gripper_index])
        return action[list(self.displacement_indices)], command

    def join(self, displacements: Action, gripper_command: float) -> Action:
        """The action of these parts; the inverse of :meth:`split`.

        Args:
            displacements: Displacements, one per displacement axis, in the unit of each.
            gripper_command: Command of the gripper, in the unit of its axis; 0 without a gripper.

        Returns:
            The action. It is not checked: see :meth:`check`.

        Raises:
            InvalidCommandError: A gripper is commanded, and there is none.
        """
        if self.gripper_index is not None:
            at = min(self.gripper_index, len(displacements))
            return np.insert(np.asarray(displacements, dtype=np.float64), at, gripper_command)
        if gripper_command != 0.0:
            raise InvalidCommandError(
                f"the gripper is commanded {gripper_command}, and this robot has none: send 0"
            )
        return np.array(displacements, dtype=np.float64)

    def check(self, action: Action) -> None:
        """Refuse what the robot must not do.

        Raises:
            InvalidCommandError: Wrong length, not finite, or out of range; names the axis.
        """
        low, high = self._bounds
        if not isinstance(action, np.ndarray) or action.shape != low.shape:
            shape = getattr(action, "shape", None)
            got = f"{type(action).__name__}, not an array" if shape is None else f"shape {shape}"
            raise InvalidCommandError(
                f"a command has {low.size} entries ({', '.join(a.name for a in self.axes)}), "
                f"got {got}"
            )
        inside = (action >= low) & (action <= high)  # False for NaN too
        if not inside.all():
            i = int(np.argmin(inside))
            raise InvalidCommandError(
                f"command {self.axes[i].name} = {action[i]} {self.axes[i].unit} is not within "
                f"[{self.low[i]}, {self.high[i]}]"
            )
