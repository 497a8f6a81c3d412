# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of things at rest, put where they can be: flat, on what they lie on, apart.

A cube measured 2 mm inside a drawer's wall would be flung about in the planner's model, and one
measured 2 mm above the table would fall. What is in the hand is left as it is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from slap_ros.geometry.oriented_box import UP, OrientedBox
from slap_ros.geometry.pose import Pose, Vector, dot, multiply, normalised, rotate
from slap_ros.relational import State
from slap_ros.worlds.contact.links import link_poses, links
from slap_ros.worlds.contact.scene import BoxPart, Compound, ContactScene, CylinderPart, Part
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.settling import AXES, FLOATING, LEANING, levelled

ROUNDS = 12  # in which a body is moved out of what it is in, one thing after the other
APART = 1e-6  # m, by which bodies may be inside one another
LEDGE = 1e-3  # m, by which a body is over what it lies on, at least
FLAT = 0.5  # sine up to which an axis counts as horizontal


class Piece(NamedTuple):
    """A part of a body at its pose in the scene."""

    part: Part
    pose: Pose
    radius: float  # m, of a ball around it

    @classmethod
    def of(cls, part: Part, pose: Pose) -> Piece:
        """A part of something that is at a pose."""
        return cls(part, pose.compose(part.pose), part.bounding_box.radius)

    def extent(self, axis: Vector) -> float:
        """How far the piece reaches from its middle along a unit vector, m."""
        if isinstance(self.part, CylinderPart):
            along = abs(dot(axis, rotate(self.pose.quaternion, UP)))
            across = math.sqrt(max(0.0, 1.0 - along * along))
            return 0.5 * self.part.length_m * along + self.part.radius_m * across
        return OrientedBox(self.pose, self.part.half_extents_m).half_extent(axis)

    def sideways(self) -> Iterator[Vector]:
        """The horizontal axes along which it may be moved out of something."""
        axes = AXES if isinstance(self.part, BoxPart) else (UP,)
        for axis in axes:
            x, y, z = rotate(self.pose.quaternion, axis)
            if abs(z) < FLAT:
                length = math.hypot(x, y)
                yield (x / length, y / length, 0.0)
                if isinstance(self.part, CylinderPart):
                    yield (-y / length, x / length, 0.0)


class SettlingObstacle(NamedTuple):
    """What a body must not be in."""

    piece: Piece
    fixed: bool = True  # False: what hovers, as the hand does; nothing is pushed down by it


class Overlap(NamedTuple):
    """How two pieces are inside one another; below 0: how far apart."""

    upward: float  # m, along the vertical
    sideways: float  # m, along the horizontal axis along which it is least
    way: Vector  # that axis, towards the first piece


def settled(scene: ContactScene, state: State) -> State:
    """The state with everything that lies still where physics would have it.

    Args:
        scene: Bodies of the scene.
        state: Measured state; the hand, what it holds, drawers and lids are where they are.

    Returns:
        The state in which nothing is in anything else, as far as there is room, and in which bodies
        at rest lie flat on what is just below them.
    """
    index = ContactIndex.of(scene, state.layout)
    snapshot = index.read(state)
    obstacles = [SettlingObstacle(piece) for piece in _standing(scene, state)]
    obstacles += [
        SettlingObstacle(Piece.of(BoxPart(half), pose), fixed=False)
        for pose, half in snapshot.hand.boxes()
    ]
    bodies = list(snapshot.bodies)
    if snapshot.held is not None:
        held = _pieces(scene.free[snapshot.held], bodies[snapshot.held].pose)
        obstacles += [SettlingObstacle(piece, fixed=False) for piece in held]
    loose = [i for i in range(len(bodies)) if i != snapshot.held]
    for i in sorted(loose, key=lambda i: bodies[i].pose.position[2]):
        still = bodies[i].still
        put = _laid_down if still else _moved_away
        pose = put(scene.free[i], bodies[i].pose, obstacles)
        bodies[i] = bodies[i]._replace(pose=pose)
        obstacles += [SettlingObstacle(piece, still) for piece in _pieces(scene.free[i], pose)]
    return index.write(state, snapshot._replace(bodies=tuple(bodies)))


def _standing(scene: ContactScene, state: State) -> Iterator[Piece]:
    """Everything that does not move by itself."""
    placed = zip(links(scene), link_poses(scene, state), strict=True)
    for link, pose in list(placed)[len(scene.free) :]:
        if link.solid:
            yield from (Piece.of(part, pose) for part in link.parts)


def _pieces(body: Compound, pose: Pose) -> list[Piece]:
    return [Piece.of(part, pose) for part in body.parts]


def _moved_away(body: Compound, measured: Pose, obstacles: Sequence[SettlingObstacle]) -> Pose:
    """The pose of a body outside of all others."""
    return _moved_out(body, measured, _beside(body, measured, obstacles))


def _laid_down(body: Compound, measured: Pose, obstacles: Sequence[SettlingObstacle]) -> Pose:
    """The pose of a body that lies flat, on what is below it, and outside of all others."""
    flat = _flat(body, measured) or measured
    beside = _beside(body, flat, obstacles)
    pose = _moved_out(body, flat, beside)
    x, y, z = pose.position
    lowered = Pose((x, y, z - _height(body, pose, beside)), pose.quaternion)
    return _moved_out(body, lowered, beside)


def _beside(
    body: Compound, pose: Pose, obstacles: Sequence[SettlingObstacle]
) -> list[SettlingObstacle]:
    """The obstacles that a body may touch on its way to where it lies."""
    around = body.at(pose)
    reach = around.radius + 2.0 * FLOATING
    return [one for one in obstacles if _near(one.piece, around.pose.position, reach)]


def _near(piece: Piece, point: Vector, distance: float) -> bool:
    return OrientedBox(piece.pose, piece.part.bounding_box.half).near(point, distance)


def _flat(body: Compound, pose: Pose) -> Pose | None:
    """The pose with the lower face exactly level; None where it is not clear which face that is.

    What is round all along lies or stands as its axis does, however it has rolled.
    """
    if not all(isinstance(part, CylinderPart) for part in body.parts):
        return levelled(pose)
    x, y, z = rotate(multiply(pose.quaternion, body.parts[0].pose.quaternion), UP)
    level = math.hypot(x, y)
    if math.atan2(abs(z), level) <= LEANING:
        goal = (x / level, y / level, 0.0)
    elif math.atan2(level, abs(z)) <= LEANING:
        goal = (0.0, 0.0, math.copysign(1.0, z))
    else:
        return None
    a, b, c = goal
    turn = (y * c - z * b, z * a - x * c, x * b - y * a, 1.0 + x * a + y * b + z * c)
    return Pose(pose.position, normalised(multiply(normalised(turn), pose.quaternion)))


def _moved_out(body: Compound, pose: Pose, near: Sequence[SettlingObstacle]) -> Pose:
    """The pose moved the shorter way out of the deepest overlap, again and again."""
    for _ in range(ROUNDS):
        shift = max(_shifts(body, pose, near), key=lambda shift: math.hypot(*shift), default=None)
        if shift is None:
            break
        x, y, z = (p + s for p, s in zip(pose.position, shift, strict=True))
        pose = Pose((x, y, z), pose.quaternion)
    return pose


def _shifts(body: Compound, pose: Pose, near: Sequence[SettlingObstacle]) -> Iterator[Vector]:
    """The ways out of everything that a body is in."""
    for piece, obstacle, overlap in _overlaps(body, pose, near):
        if min(overlap.upward, overlap.sideways) <= APART:
            continue
        above = piece.pose.position[2] >= obstacle.piece.pose.position[2]
        if overlap.sideways < overlap.upward:
            x, y, _ = overlap.way
            yield (x * overlap.sideways, y * overlap.sideways, 0.0)
        elif above or obstacle.fixed:
            yield (0.0, 0.0, math.copysign(overlap.upward, 1.0 if above else -1.0))


def _height(body: Compound, pose: Pose, near: Sequence[SettlingObstacle]) -> float:
    """How far above what it lies on a body is, m; 0 where nothing is just below it."""
    gaps = [
        -overlap.upward
        for piece, obstacle, overlap in _overlaps(body, pose, near)
        if overlap.sideways > LEDGE
        and overlap.upward <= APART
        and piece.pose.position[2] > obstacle.piece.pose.position[2]
    ]
    height = min(gaps, default=math.inf)
    return max(0.0, height) if height <= FLOATING else 0.0


def _overlaps(
    body: Compound, pose: Pose, near: Sequence[SettlingObstacle]
) -> Iterator[tuple[Piece, SettlingObstacle, Overlap]]:
    for piece in _pieces(body, pose):
        for obstacle in near:
            yield piece, obstacle, _overlap(piece, obstacle.piece)


def _overlap(first: Piece, second: Piece) -> Overlap:
    x, y, z = (p - q for p, q in zip(first.pose.position, second.pose.position, strict=True))
    upward = first.extent(UP) + second.extent(UP) - abs(z)
    found = [
        (first.extent(axis) + second.extent(axis) - abs(dot(axis, (x, y, z))), axis)
        for axis in _ways(first, second, (x, y, z))
    ]
    depth, (a, b, _) = min(found)
    sign = math.copysign(1.0, a * x + b * y)
    return Overlap(upward, depth, (sign * a, sign * b, 0.0))


def _ways(first: Piece, second: Piece, offset: Vector) -> Iterable[Vector]:
    """The horizontal axes that may separate two pieces."""
    x, y, _ = offset
    length = math.hypot(x, y)
    between = ((x / length, y / length, 0.0),) if length > APART else ((1.0, 0.0, 0.0),)
    return (*first.sideways(), *second.sideways(), *between)
