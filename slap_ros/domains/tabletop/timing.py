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
    def step(self) -> Sequence[float]:
        """How far joints may go in a step, rad."""
        ...

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """Positions in rad, shape (n, 7), without the start; corners may be cut where free."""
        ...

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """Positions that pieces take at least, be they straight or bent between the same ends."""
        ...


class SpeedLimitTiming:
    """As fast as the joints may move, without stopping in between."""

    step: Sequence[float] = MAX_STEP

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """See :class:`Timing`."""
        path = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
        return retime(path, free=free)

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """See :class:`Timing`. What is bent is longer, and a stop at a corner costs more."""
        return math.ceil(sum(path_steps(piece) for piece in pieces) - ROUNDING)


class FixedStepTiming:
    """The paper's timing: ten steps up, ten down, ten for each straight piece across."""

    step: Sequence[float] = (math.pi,) * JOINTS

    def positions(self, pieces: Sequence[Path], free: Free) -> Joints:
        """See :class:`Timing`."""
        del free  # corners are not cut
        up, *across, down = (*pieces, pieces[-1][-1:]) if len(pieces) == 1 else pieces
        return np.concatenate([retime_fixed_steps(p) for p in (_ends(up), *across, _ends(down))])

    def least_steps(self, pieces: Sequence[Path]) -> int:
        """See :class:`Timing`."""
        return sum(len(retime_fixed_steps(_ends(piece))) for piece in pieces)


def _ends(path: Path) -> Path:
    """Straight from end to end; one row where these are the same."""
    return path[:1] if np.array_equal(path[0], path[-1]) else path[[0, -1]]
