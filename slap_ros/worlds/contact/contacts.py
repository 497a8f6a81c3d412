# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What touches what, and how hard; and what the hand has grasped.

A body is grasped when both fingers press on it from opposite sides. Poses do not show that, so
the world writes it into the state.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum
from typing import NamedTuple

from slap_ros.geometry.pose import Pose, Vector, rotate

PRESSING_N = 0.5  # that each finger presses with, at least, on what is grasped
TOUCHING_M = 1e-3  # bodies that are nearer than this move together


class Side(Enum):
    """What a contact point is on."""

    PALM = "palm"
    LEFT_FINGER = "left finger"
    RIGHT_FINGER = "right finger"
    FREE = "free"
    FIXED = "fixed"
    FRAME = "frame"  # of a jointed body
    MOVING = "moving"  # part of a jointed body

    # Members are compared by identity. Enum's own hash, of the name, is slow where thousands are
    # looked up in a second.
    __hash__ = object.__hash__


FINGERS = frozenset({Side.LEFT_FINGER, Side.RIGHT_FINGER})
HAND = FINGERS | {Side.PALM}


class Surface(NamedTuple):
    """A body, or the part of one, that is touched."""

    side: Side
    number: int = 0  # among the scene's bodies of that kind


class ContactPoint(NamedTuple):
    """A point in which two bodies touch or are about to."""

    first: Surface
    second: Surface
    position: Vector  # m, on the second one
    normal: Vector  # of the second one's surface, towards the first one
    distance: float  # m; below 0, how deep they are in one another
    force_n: float  # along the normal, in the last substep


def grasped(points: Iterable[ContactPoint], hand: Pose) -> int | None:
    """The free body that both fingers press on from opposite sides; the one gripped hardest.

    Args:
        points: Contact points.
        hand: Pose of the hand; the fingers move along its y.
    """
    x, y, z = rotate(hand.quaternion, (0.0, 1.0, 0.0))
    pressing: dict[int, dict[Side, float]] = {}
    for first, second, _, (u, v, w), _, force_n in points:
        finger, body, sign = first, second, 1.0  # the normal is the body's, towards the finger
        if first.side is Side.FREE:
            finger, body, sign = second, first, -1.0
        if body.side is not Side.FREE or finger.side not in FINGERS:
            continue
        if finger.side is Side.RIGHT_FINGER:  # outwards is the other way
            sign = -sign
        along = sign * (u * x + v * y + w * z)
        if along > 0.0:
            forces = pressing.setdefault(body.number, dict.fromkeys(FINGERS, 0.0))
            forces[finger.side] += along * force_n
    grips = {body: min(forces.values()) for body, forces in pressing.items()}
    held = max(grips, key=lambda body: grips[body], default=None)
    return held if held is not None and grips[held] >= PRESSING_N else None


def groups(points: Iterable[ContactPoint], surfaces: Sequence[Surface]) -> list[set[Surface]]:
    """The bodies that touch one another, directly or by others; fixed ones pass nothing on.

    Args:
        points: Contact points.
        surfaces: Bodies to be grouped, the hand as its palm; each is in one group.
    """
    group = {surface: {surface} for surface in surfaces}
    for one, other, _, _, distance, _ in points:
        if distance > TOUCHING_M:
            continue
        first, second = _whole(one), _whole(other)
        if first not in group or second not in group or group[first] is group[second]:
            continue
        joined = group[first] | group[second]
        for surface in joined:
            group[surface] = joined
    return list({id(members): members for members in group.values()}.values())


THE_HAND = Surface(Side.PALM)  # stands for its fingers too


def _whole(surface: Surface) -> Surface:
    """The surface that stands for a body: the palm for the hand. Frames pass nothing on."""
    return THE_HAND if surface.side in HAND else surface
