# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a control period involves: which bodies can be touched in it, by what can move.

Everything is judged by boxes along the axes of the base, which is quick and never misses a touch.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Quaternion, Vector
from slap_ros.worlds.contact.hand import PAD, PALM, STEM, HandState
from slap_ros.worlds.contact.scene import Compound, JointedBody

TOUCH = 0.002  # m: what is nearer than this may touch already


class Involved(NamedTuple):
    """What is computed: bodies by number, the scene's free ones first, then the jointed ones."""

    bodies: tuple[int, ...] = ()  # ascending
    hand: bool = True


class Bounds(NamedTuple):
    """A box along the axes of the base."""

    low: Vector  # m
    high: Vector

    def grown(self, margin: float) -> Bounds:
        """The bounds with a layer of ``margin`` m around them."""
        (a, b, c), (d, e, f) = self
        return Bounds((a - margin, b - margin, c - margin), (d + margin, e + margin, f + margin))

    def hull(self, other: Bounds) -> Bounds:
        """The bounds around both boxes."""
        (a, b, c), (d, e, f) = self
        (u, v, w), (x, y, z) = other
        return Bounds((min(a, u), min(b, v), min(c, w)), (max(d, x), max(e, y), max(f, z)))

    def meets(self, other: Bounds) -> bool:
        """Whether the two share a point."""
        (a, b, c), (d, e, f) = self
        (u, v, w), (x, y, z) = other
        return a <= x and u <= d and b <= y and v <= e and c <= z and w <= f


def meet(some: Iterable[Bounds], others: Iterable[Bounds]) -> bool:
    """Whether any of some shares a point with any of others."""
    for first in some:
        for second in others:
            if first.meets(second):
                return True
    return False


def bounds_of(box: OrientedBox) -> Bounds:
    """The bounds of an oriented box."""
    (x, y, z), quaternion = box.pose
    u, v, w = _world_extents(quaternion, box.half)
    return Bounds((x - u, y - v, z - w), (x + u, y + v, z + w))


def hull_of(boxes: Iterable[OrientedBox]) -> Bounds:
    """The bounds of several; at least one."""
    first, *others = (bounds_of(box) for box in boxes)
    for other in others:
        first = first.hull(other)
    return first


def rigid_bounds(body: Compound, pose: Pose) -> Bounds:
    """The bounds of a rigid body at a pose."""
    return bounds_of(body.at(pose))


def part_bounds(body: Compound, pose: Pose) -> list[Bounds]:
    """The bounds of each part of a rigid body: of a wall with a hole, not the hole."""
    return [bounds_of(part.bounding_box.at(pose)) for part in body.parts]


def frame_bounds(body: JointedBody, pose: Pose) -> Bounds:
    """The bounds of the frame of a jointed body that stands there."""
    return hull_of(part.bounding_box.at(pose) for part in body.frame)


def moving_bounds(body: JointedBody, pose: Pose, opening: float) -> Bounds:
    """The bounds of the moving part of a jointed body.

    Args:
        body: Jointed body that has the moving part.
        pose: Pose of the body.
        opening: Opening of the body's joint, m or rad.
    """
    return bounds_of(body.moving_box.at(body.moving_pose(pose, opening)))


# Both fingers in one box, at finger position 0: how far they reach in the hand's frame.
_FINGERS_ASIDE = STEM.pose.position[1] + STEM.half_extents_m[1]  # m
_FINGERS_WIDE = max(PAD.half_extents_m[0], STEM.half_extents_m[0])
_FINGERS_TIP = PAD.pose.position[2] + PAD.half_extents_m[2]
_FINGERS_ROOT = STEM.pose.position[2] - STEM.half_extents_m[2]


def hand_bounds(hand: HandState) -> tuple[Bounds, Bounds]:
    """The bounds of the palm, and of both fingers together."""
    left, right = hand.fingers
    middle = (0.0, 0.5 * (left - right), 0.5 * (_FINGERS_TIP + _FINGERS_ROOT))
    half = (
        _FINGERS_WIDE,
        _FINGERS_ASIDE + 0.5 * (left + right),
        0.5 * (_FINGERS_TIP - _FINGERS_ROOT),
    )
    pose, turn = hand.pose, hand.pose.quaternion  # both boxes are turned as the hand is
    return (
        bounds_of(OrientedBox(Pose(pose.apply(PALM.pose.position), turn), PALM.half_extents_m)),
        bounds_of(OrientedBox(Pose(pose.apply(middle), turn), half)),
    )


UPRIGHT = 0.01  # 1, of z and w of its quaternion: a hand that points straight down, nearly
_AROUND, _ABOVE, _BELOW = 0.113, 0.14, 0.017  # m, no part of such a hand is further away


def space_of_way(start: Pose, end: Pose, margin: float) -> Bounds | None:
    """A space that a hand does not leave on its way, however it is turned about the vertical.

    Args:
        start: Pose of the hand at the beginning.
        end: Pose that the hand is pulled to.
        margin: Largest distance from the straight way, m.

    Returns:
        None where the hand does not point straight down.
    """
    if any(abs(q) > UPRIGHT for q in (*start.quaternion[2:], *end.quaternion[2:])):
        return None
    (a, b, c), (x, y, z) = start.position, end.position
    aside = _AROUND + margin
    return Bounds(
        (min(a, x) - aside, min(b, y) - aside, min(c, z) - _BELOW - margin),
        (max(a, x) + aside, max(b, y) + aside, max(c, z) + _ABOVE + margin),
    )


class Mover(NamedTuple):
    """Something that can move in a period."""

    spaces: tuple[Bounds, ...]  # where it can touch something
    push: float  # m, how far it can push that

    @classmethod
    def of(cls, bounds: Bounds, travel: float) -> Mover:
        """The mover that begins in these bounds and goes so far, in m, in any direction."""
        return cls((bounds.grown(travel + TOUCH),), travel)


def touched(movers: Sequence[Mover], resting: Sequence[Bounds | None]) -> dict[int, Mover]:
    """The resting bodies that movers can touch, or bodies that these push.

    Args:
        movers: Spaces in which each mover can touch something, and how far it can push that.
        resting: Bounds of the bodies that rest, None for those that do not.

    Returns:
        Each that can be touched, by its index; it goes as far as what touches it can push it.
    """
    found: dict[int, Mover] = {}
    queue = list(movers)
    while queue:
        spaces, push = queue.pop()
        for i, bounds in enumerate(resting):
            if bounds is not None and i not in found and meet(spaces, (bounds,)):
                found[i] = Mover.of(bounds, push)
                queue.append(found[i])
    return found


def clusters(bounds: Sequence[Bounds | None]) -> list[tuple[int, ...]]:
    """Bodies, by number, that may touch one another, directly or by others; None is no body."""
    left, found = list(bounds), []
    for i, box in enumerate(bounds):
        if box is None or left[i] is None:
            continue
        left[i] = None
        members = touched([Mover.of(box, 0.0)], left)
        for j in members:
            left[j] = None
        found.append(tuple(sorted([i, *members])))
    return found


def _world_extents(q: Quaternion, half: Vector) -> Vector:
    """How far a box of that orientation reaches along each axis of the base."""
    x, y, z, w = q
    a, b, c = half
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        abs(1.0 - 2.0 * (yy + zz)) * a + 2.0 * abs(xy - wz) * b + 2.0 * abs(xz + wy) * c,
        2.0 * abs(xy + wz) * a + abs(1.0 - 2.0 * (xx + zz)) * b + 2.0 * abs(yz - wx) * c,
        2.0 * abs(xz - wy) * a + 2.0 * abs(yz + wx) * b + abs(1.0 - 2.0 * (xx + yy)) * c,
    )
