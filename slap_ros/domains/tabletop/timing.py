# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How paths become joint positions, one a control step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slap_ros.motion import Free, Joints, Path, path_steps, retime, retime_fixed_steps
from slap_ros.worlds.panda import JOINTS, MAX_STEP

ROUNDING = 1e-6  # control steps


class Timing(Protocol):
    """How paths become positions, one a control step."""

    @property
    def max_step(self) -> Sequence[float]:
        """How far each joint may go in a control step, rad."""
        ...

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """Joint positions, rad, shape (n, 7), without the start; corners may be cut where free."""
        ...

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """Fewest positions for pieces with the same ends, be they straight or bent."""
        ...


class SpeedLimitTiming:
    """As fast as the joints may move, without stopping in between."""

    max_step: Sequence[float] = MAX_STEP

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """All pieces as one path, retimed; see :class:`Timing`."""
        path = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
        return retime(path, free=free)

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """The pieces at full speed: bent ones are longer, and stops at corners cost more."""
        return math.ceil(sum(path_steps(piece) for piece in pieces) - ROUNDING)


class FixedStepTiming:
    """The paper's timing: ten steps up, ten down, ten for each radian begun on the way across."""

    max_step: Sequence[float] = (math.pi,) * JOINTS

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """Multiples of ten positions, without cutting corners; see :class:`Timing`."""
        del free  # corners are not cut
        timed = zip(_straightened(pieces), _by_radians(pieces), strict=True)
        return np.concatenate([retime_fixed_steps(p, per_radian=radians) for p, radians in timed])

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """As many as if the way across were straight; see :class:`Timing`."""
        timed = zip(map(_ends, pieces), _by_radians(pieces), strict=True)
        return sum(len(retime_fixed_steps(p, per_radian=radians)) for p, radians in timed)


def _by_radians(pieces: Sequence[Path]) -> list[bool]:
    """Which pieces lead across, and not up or down: all but the first and the last."""
    return [0 < i < len(pieces) - 1 for i in range(len(pieces))]


def _straightened(pieces: Sequence[Path]) -> list[Path]:
    """The pieces, those up and down straight from end to end."""
    return [
        piece if across else _ends(piece)
        for piece, across in zip(pieces, _by_radians(pieces), strict=True)
    ]


def _ends(path: Path) -> Path:
    """Straight from end to end; one row where these are the same."""
    return path[:1] if np.array_equal(path[0], path[-1]) else path[[0, -1]]
