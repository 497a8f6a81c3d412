# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint positions of the arm, as measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from slap_ros.errors import InvalidMeasurementError
from slap_ros.worlds.panda import JOINTS

STANDS = 0.05  # rad/s, of each joint of an arm at rest
# No joint of an arm is so far beyond its limits, nor a finger so far out: another unit was meant.
BEYOND = 1.0  # rad
FINGER_RANGE = (-0.01, 0.1)  # m, of one finger


@dataclass(frozen=True)
class JointReading:
    """What the robot's encoders measure."""

    stamp_s: float  # when it was measured
    joints: tuple[float, ...]  # rad
    velocities: tuple[float, ...] = ()  # rad/s; empty: not measured
    gap: float | None = None  # m, between the fingers; None: not measured

    def __post_init__(self) -> None:
        """Refuse what cannot be a measurement.

        Raises:
            InvalidMeasurementError: Not seven joints, or not finite.
        """
        numbers = (*self.joints, *self.velocities, 0.0 if self.gap is None else self.gap)
        if len(self.joints) != JOINTS or not all(map(math.isfinite, numbers)):
            raise InvalidMeasurementError(f"joint positions {self.joints} are not {JOINTS} numbers")

    @property
    def at_rest(self) -> bool:
        """Whether the arm stands, as far as velocities are measured."""
        return all(abs(v) <= STANDS for v in self.velocities)


@dataclass(frozen=True)
class JointLists:
    """What a driver says of its joints: lists side by side, each complete or empty.

    That is the standard of ``sensor_msgs/JointState``. Of lists that do not fit, nobody knows which
    entry is missing, so none of them is used.

    Args:
        names: Names of the joints.
        positions: rad or m.
        velocities: rad/s or m/s.
        efforts: Nm or N.
    """

    names: Sequence[str]
    positions: Sequence[float] = ()
    velocities: Sequence[float] = ()
    efforts: Sequence[float] = ()

    def __post_init__(self) -> None:
        """Refuse lists of unequal length.

        Raises:
            InvalidMeasurementError: Lengths differ, or a name occurs twice.
        """
        lists = {"position": self.positions, "velocity": self.velocities, "effort": self.efforts}
        for what, values in lists.items():
            if len(values) not in (0, len(self.names)):
                raise InvalidMeasurementError(
                    f"a joint state has {len(self.names)} names, but a list {what} of "
                    f"{len(values)}: it must be as long, or empty"
                )
        if len(set(self.names)) != len(self.names):
            twice = sorted({name for name in self.names if list(self.names).count(name) > 1})
            raise InvalidMeasurementError(f"a joint state names {', '.join(twice)} twice")

    @property
    def position(self) -> Mapping[str, float]:
        """Positions by joint; empty where they are not measured."""
        return self._by_name(self.positions)

    @property
    def velocity(self) -> Mapping[str, float]:
        """Velocities by joint; empty where they are not measured."""
        return self._by_name(self.velocities)

    def _by_name(self, values: Sequence[float]) -> Mapping[str, float]:
        return MappingProxyType(dict(zip(self.names, values, strict=True)) if len(values) else {})


def require_radians(joints: Sequence[float], low: Sequence[float], high: Sequence[float]) -> None:
    """Refuse joint positions that are in another unit.

    Args:
        joints: Positions, rad.
        low: Lower limits of the arm, rad.
        high: Upper limits of the arm, rad.

    Raises:
        InvalidMeasurementError: One is not finite, or far beyond its limits.
    """
    for i, (least, q, most) in enumerate(zip(low, joints, high, strict=True), start=1):
        if not least - BEYOND <= q <= most + BEYOND:
            raise InvalidMeasurementError(
                f"joint {i} is measured at {q:.6g}, far beyond [{least}, {most}] rad: are "
                "positions in rad?"
            )


def gap_between(fingers: Sequence[float]) -> float:
    """The gap between two fingers, m.

    Args:
        fingers: Their positions, m.

    Raises:
        InvalidMeasurementError: One is not finite, or further out than fingers are.
    """
    low, high = FINGER_RANGE
    if not all(low <= position <= high for position in fingers):
        raise InvalidMeasurementError(
            f"fingers are measured at {', '.join(f'{q:.6g}' for q in fingers)}, not within "
            f"[{low}, {high}] m: are positions in m?"
        )
    return sum(fingers)
