# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arm in one configuration and on its way to another: what it is near, what it hits.

A held body is one more link on the hand.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, Self, TypeVar

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY, Pose, Quaternion, Vector
from slap_ros.tiered_function import TieredFunction
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.joint_space.scene import Body
from slap_ros.worlds.panda import HAND, link_poses

T = TypeVar("T")

CLEARANCE = 0.003  # m, between the boxes around a link and a body, at which they do not touch
LINK_DEPTH = 0.01  # m, how far a link may reach into a fixed body
HELD_DEPTH = 0.02  # m, how far a held body may
SAMPLING = 0.02  # m, of a link's way between two samples of what it hits, at the finest
SPACINGS = (0.01, 0.001)  # m, the same for what it comes near, the finer where the coarser does

_RADII = tuple(shape.radius for shape in LINK_SHAPES)


class Surroundings(tuple[T, ...]):
    """Things that stand still around the arm; equal to themselves alone, and so found at once."""

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other


class Way(Protocol):
    """The arm's way from one configuration to another; see :class:`Sweep`."""

    @property
    def start(self) -> Posture:
        """The arm at its beginning."""
        ...

    @property
    def end(self) -> Posture:
        """The arm at its end."""
        ...

    def stays_clear(self, boxes: Surroundings[OrientedBox]) -> bool:
        """See :meth:`Sweep.stays_clear`."""
        ...

    def hits(self, obstacles: Surroundings[Obstacle]) -> bool:
        """See :meth:`Sweep.hits`."""
        ...

    def deepest_penetration(
        self, obstacles: Surroundings[Obstacle], held_depth: float = HELD_DEPTH
    ) -> Penetration | None:
        """See :meth:`Sweep.deepest_penetration`."""
        ...

    def drives(self) -> list[Drive]:
        """See :meth:`Sweep.drives`."""
        ...


class Posture(Protocol):
    """The arm in one configuration; see :class:`Arm`."""

    @property
    def links(self) -> tuple[Pose, ...]:
        """Where the links are, then the held body."""
        ...

    @property
    def held_pose(self) -> Pose:
        """Pose of the held body; only where there is one."""
        ...

    def to(self, end: Self) -> Way:
        """See :meth:`Arm.to`."""
        ...


@dataclass(frozen=True)
class Arm:
    """Where the links are, in the order of ``LINK_SHAPES``, then the held body."""

    links: tuple[Pose, ...]
    centres: tuple[Vector, ...]  # of the boxes around them
    radii: tuple[float, ...]  # m, half the boxes' diagonals
    held: Body | None
    _boxes: dict[int, OrientedBox] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def at(
        cls,
        joints: Sequence[float],
        finger: float,
        held: Body | None = None,
        grasp: Pose = IDENTITY,
    ) -> Arm:
        """The arm in one configuration.

        Args:
            joints: Joint positions, rad, shape (7,).
            finger: Distance of each finger from the middle, m.
            held: Body in the hand; None if there is none.
            grasp: Pose of the held body in the hand's frame.

        Returns:
            Everything in the base's frame.
        """
        poses = link_poses(joints, finger)
        links = [poses[shape.link] for shape in LINK_SHAPES]
        centres = [
            link.apply(shape.frame.position) for link, shape in zip(links, LINK_SHAPES, strict=True)
        ]
        radii = _RADII
        if held is not None:
            links.append(poses[HAND].compose(grasp))
            box = held.at(links[-1])
            centres.append(box.pose.position)
            radii = (*_RADII, box.radius)
        return cls(tuple(links), tuple(centres), radii, held)

    @property
    def held_pose(self) -> Pose:
        """Pose of the held body; only where there is one."""
        return self.links[len(LINK_SHAPES)]

    def to(self, end: Arm) -> Sweep:
        """The way from here to another configuration."""
        return Sweep(self, end)

    def box(self, link: int) -> OrientedBox:
        """The box around a link, which is asked for again and again."""
        box = self._boxes.get(link)
        if box is None:
            box = self._boxes[link] = self.box_at(link, self.links[link])
        return box

    def near(self, link: int, point: Vector, distance: float) -> bool:
        """Whether a point is near the box around a link.

        Args:
            link: Index in ``LINK_SHAPES``; one more is the held body.
            point: Point in the base's frame, m.
            distance: Distance from which on the point is no longer near, m.

        Returns:
            Whether it is closer than that.
        """
        reach = distance + self.radii[link]
        return _distance(point, self.centres[link]) < reach and self.box(link).near(point, distance)

    def box_at(self, link: int, pose: Pose) -> OrientedBox:
        """The box around a link, were the link at that pose."""
        if link < len(LINK_SHAPES):
            return LINK_SHAPES[link].at(pose)
        if self.held is None:
            raise IndexError("nothing is held")
        return self.held.at(pose)


class Obstacle(NamedTuple):
    """A fixed body that the arm must not enter."""

    box: OrientedBox
    top: float  # m, height of its highest point

    @classmethod
    def of(cls, box: OrientedBox) -> Obstacle:
        """An obstacle that fills a box."""
        return cls(box, box.top)


class Penetration(NamedTuple):
    """A point of the arm that is further inside a fixed body than it may be."""

    link: int  # index in panda.LINKS
    point: Vector
    depth: float  # m, by which it has to be raised


class Sweep:
    """The arm's way from one configuration to another in a control step.

    ``kernels.py`` has the same as compiled code, to the bit.
    """

    __slots__ = ("end", "start", "travel")

    def __init__(self, start: Arm, end: Arm) -> None:
        self.start, self.end = start, end
        # How far any point of each link goes at most, in m.
        self.travel = [
            _distance(a, b) + _angle(p.quaternion, q.quaternion) * radius
            for a, b, p, q, radius in zip(
                start.centres, end.centres, start.links, end.links, start.radii, strict=True
            )
        ]

    def stays_clear(self, boxes: Sequence[OrientedBox]) -> bool:
        """Whether no link comes near any of the boxes, which stand still."""
        around = [(box, box.radius) for box in boxes]
        highest = max((box.pose.position[2] + radius for box, radius in around), default=-math.inf)
        # The hand, and what it holds, come last and touch first.
        links = range(len(self.travel) - 1, -1, -1)
        return not any(self._comes_near(link, around, highest) for link in links)

    def _comes_near(
        self, link: int, around: Sequence[tuple[OrientedBox, float]], highest: float
    ) -> bool:
        """Whether a link comes near a box; mostly, the ball around the box already excludes it.

        Args:
            link: Index in ``LINK_SHAPES``; one more is the held body.
            around: Boxes, each with its radius, m.
            highest: Height of the highest point of the balls around the boxes, m.
        """
        # A point is never further than half of its way from where it starts or where it ends.
        margin = CLEARANCE + 0.5 * self.travel[link]
        low = min(self.start.centres[link][2], self.end.centres[link][2])
        if low - margin - self.start.radii[link] > highest:
            return False
        for box, radius in around:
            ball = box.pose.position, margin + radius
            near = self.start.near(link, *ball) or self.end.near(link, *ball)
            if near and self._touches_on_the_way(link, box):
                return True
        return False

    def _touches_on_the_way(self, link: int, box: OrientedBox) -> bool:
        """Whether the box around a link comes near another anywhere on its way."""
        return all(self._touches(link, box, spacing) for spacing in SPACINGS)

    def _touches(self, link: int, box: OrientedBox, spacing: float) -> bool:
        """Whether it may, as far as samples of its way tell that are so far apart (m) at most."""
        samples = math.ceil(self.travel[link] / spacing) or 1
        around = box.grown(CLEARANCE + 0.5 * self.travel[link] / samples)
        from_end = range(samples, -1, -1)  # where it mostly is when it touches
        return any(around.overlaps(self._at(link, k / samples)) for k in from_end)

    def hits(self, obstacles: Sequence[Obstacle]) -> bool:
        """Whether the arm enters an obstacle deeper than it may, at the end of its way.

        Thin obstacles are also looked for on the way, or the arm would pass through them.
        """
        end = self.end
        for link, (travel, centre, radius) in enumerate(
            zip(self.travel, end.centres, end.radii, strict=True)
        ):
            reach = radius + travel
            for box, top in obstacles:
                if (
                    centre[2] - reach < top
                    and box.near(centre, reach)
                    and self._enters(link, box, _depth(link))
                ):
                    return True
        return False

    def deepest_penetration(
        self, obstacles: Sequence[Obstacle], held_depth: float = HELD_DEPTH
    ) -> Penetration | None:
        """Where the arm would be deepest in an obstacle, seen from above; None if in none.

        Args:
            obstacles: Fixed bodies.
            held_depth: How far a held body may reach into one, m.
        """
        found = None
        for link, travel in enumerate(self.travel):
            reach = self.end.radii[link] + travel
            core = _depth(link) if link < len(LINK_SHAPES) else held_depth
            for box, top in obstacles:
                if box.near(self.end.centres[link], reach) and self._enters(link, box, core):
                    point = min(self.end.box(link).corners(), key=lambda corner: corner[2])
                    depth = top - core - point[2]
                    if depth > 0.0 and (found is None or depth > found.depth):
                        found = Penetration(carrier(link), point, depth)
        return found

    def drives(self) -> list[Drive]:
        """How each link moves on this way, the held body last."""
        ways = zip(self.start.links, self.end.links, strict=True)
        return [Drive.between(start, end) for start, end in ways]

    def _enters(self, link: int, box: OrientedBox, depth: float) -> bool:
        core = box.shrunk(depth)
        samples = math.ceil(self.travel[link] / max(2.0 * min(box.half), SAMPLING)) or 1
        return any(core.overlaps(self._at(link, k / samples)) for k in range(1, samples + 1))

    def _at(self, link: int, part: float) -> OrientedBox:
        """The box around a link after a part of its way."""
        if part == 1.0:
            return self.end.box(link)
        (p, q), (u, v) = self.start.links[link], self.end.links[link]
        sign = math.copysign(1.0, q[0] * v[0] + q[1] * v[1] + q[2] * v[2] + q[3] * v[3])
        x, y, z, w = (a + part * (sign * b - a) for a, b in zip(q, v, strict=True))
        length = math.sqrt(x * x + y * y + z * z + w * w)
        px, py, pz = (a + part * (b - a) for a, b in zip(p, u, strict=True))
        pose = Pose((px, py, pz), (x / length, y / length, z / length, w / length))
        return self.start.box_at(link, pose)


def carrier(link: int) -> int:
    """Which of the robot's links a link is, or is held by: an index in ``panda.LINKS``."""
    return LINK_SHAPES[link].link if link < len(LINK_SHAPES) else HAND


def _depth(link: int) -> float:
    """How far a link may reach into a fixed body, m."""
    return LINK_DEPTH if link < len(LINK_SHAPES) else HELD_DEPTH


def _distance(a: Vector, b: Vector) -> float:
    """The distance of two points, m: compiled code cannot have the last bits of ``math.dist``."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


def _angle(p: Quaternion, q: Quaternion) -> float:
    """The angle between two orientations in rad, to 1e-8."""
    return 2.0 * math.acos(min(1.0, abs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3])))


# From joint positions, finger, held body and grasp, as Arm.at has them.
PostureAt = Callable[[Sequence[float], float, Body | None, Pose], Posture]


def _compiled_arm() -> PostureAt:
    from slap_ros.worlds.joint_space.compiled_arm import CompiledArm

    return CompiledArm


POSTURE_AT: TieredFunction[PostureAt] = TieredFunction(Arm.at, _compiled_arm)
