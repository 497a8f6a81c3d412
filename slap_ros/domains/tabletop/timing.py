# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How paths become joint positions, one a control step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from slap_ros.motion import Free, Joints, Path, path_steps, retime, retime_fixed_steps
from slap_ros.physics.panda import JOINTS, MAX_STEP

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
    """The paper's timing: ten steps up, ten down, ten for each straight piece across."""

    max_step: Sequence[float] = (math.pi,) * JOINTS

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """Ten positions for each piece, without cutting corners; see :class:`Timing`."""
        del free  # corners are not cut
        up, *across, down = (*pieces, pieces[-1][-1:]) if len(pieces) == 1 else pieces
        return np.concatenate([retime_fixed_steps(p) for p in (_ends(up), *across, _ends(down))])

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """Ten for each piece that has a length; see :class:`Timing`."""
        return sum(len(retime_fixed_steps(_ends(piece))) for piece in pieces)


def _ends(path: Path) -> Path:
    """Straight from end to end; one row where these are the same."""
    return path[:1] if np.array_equal(path[0], path[-1]) else path[[0, -1]]
