# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a domain looks: bodies for viewers and reports, and its own animations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from slap_ros.geometry.pose import Pose
from slap_ros.relational import State


@dataclass(frozen=True)
class VisibleBody:
    """A box to be shown, or a body of triangles; pose in the world frame.

    Boxes that are parts of one thing have the same name.
    """

    name: str
    position: tuple[float, float, float]  # m, of its centre
    quaternion: tuple[float, float, float, float]  # x y z w
    size: tuple[float, float, float]  # m, its edges
    colour: tuple[float, float, float, float]  # red green blue opacity, 0 to 1
    # Three corners each, m, in the body's own frame; without any it is a box.
    triangles: tuple[tuple[float, float, float], ...] = ()


class PictureSize(NamedTuple):
    """The size of a picture, in pixels; even, as a video needs it."""

    width: int
    height: int


# Writes states, one per control step, as a GIF or MP4, of a size (None: its own); calls back with
# the frames done so far.
Animate = Callable[[Path, Sequence[State], PictureSize | None, Callable[[int], None]], None]


@dataclass(frozen=True)
class Display:
    """What a person is shown of a state; nothing of it matters to planning.

    Args:
        bodies: Function from a state to its bodies, in an order that does not change.
        arm: Function from a state to the robot's own shapes, unless the robot is one of the bodies.
        frames: Function from a state to poses by name, for TF; None: the poses of the bodies.
        animate: Function that writes an animation; None: the bodies are drawn plainly.
    """

    bodies: Callable[[State], Sequence[VisibleBody]] = lambda _: ()
    arm: Callable[[State], Sequence[VisibleBody]] = lambda _: ()
    frames: Callable[[State], Mapping[str, Pose]] | None = None
    animate: Animate | None = None
