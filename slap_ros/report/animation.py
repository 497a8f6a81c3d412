# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes as drawings that a page can play: every path written once, and when it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from slap_ros.core import VisibleBody
from slap_ros.drawing.meshes import body_paths
from slap_ros.drawing.occlusion import painting_order
from slap_ros.drawing.projection import (
    OBLIQUE,
    SIDE,
    TOP,
    Canvas,
    Point,
    Projection,
    corners,
)
from slap_ros.geometry.pose import Vector
from slap_ros.report.scene import RecordedScene, SceneFrame

MARGIN = 0.08  # around what moves, of its extent
ARM_WIDTH_M = 0.075
STILL = 1e-4  # m: bodies that move less do not decide what is drawn
NOTHING = ("", "", "")
T = TypeVar("T")


@dataclass(frozen=True)
class AnimatedShape:
    """A body or the arm in one view."""

    fill: str  # colour of a body; empty: the arm
    poses: tuple[tuple[str, ...], ...]  # paths, one for each element that draws it
    at: tuple[int, ...]  # which of the poses, by frame


@dataclass(frozen=True)
class Drawing:
    """A scene in one view."""

    view: str
    height: int  # units; the width is UNITS
    arm_width: int  # units
    shapes: tuple[AnimatedShape, ...]
    orders: tuple[tuple[int, ...], ...]  # shapes from back to front
    order_at: tuple[int, ...]  # which of the orders, by frame

    def shown(self, frame: int) -> list[tuple[int, AnimatedShape, tuple[str, ...]]]:
        """The shapes of a frame from back to front, with their numbers and paths."""
        order = self.orders[self.order_at[frame]]
        return [(i, self.shapes[i], self.shapes[i].poses[self.shapes[i].at[frame]]) for i in order]

    def as_json(self) -> dict[str, Any]:
        """What the page's player needs."""
        return {
            "shapes": [{"poses": s.poses, "at": s.at} for s in self.shapes],
            "orders": self.orders,
            "orderAt": self.order_at,
        }


def draw(scenes: Sequence[RecordedScene]) -> list[tuple[Drawing, ...]]:
    """Drawings of every scene, all of them to the same scale, so that they compare."""
    frames = [frame for scene in scenes for frame in scene.frames]
    moving = [_moving(scene) for scene in scenes]
    points = [
        p for scene, numbers in zip(scenes, moving, strict=True) for p in _reach(scene, numbers)
    ]
    canvases = [(view, Canvas.around(map(view.project, points), MARGIN)) for view in _views(frames)]
    return [
        tuple(_draw(scene, view, canvas, numbers) for view, canvas in canvases)
        for scene, numbers in zip(scenes, moving, strict=True)
    ]


def _views(frames: Iterable[SceneFrame]) -> tuple[Projection, ...]:
    """All, or only the side view of a world that is a side view itself."""
    depths = {round(body.position[1], 6) for frame in frames for body in frame.bodies}
    return (SIDE,) if len(depths) == 1 else (OBLIQUE, SIDE, TOP)


def _moving(scene: RecordedScene) -> frozenset[int]:
    """The numbers of the bodies that move; all of them where none does."""
    first = scene.frames[0].bodies
    moving = frozenset(
        i
        for frame in scene.frames
        for i, (body, start) in enumerate(zip(frame.bodies, first, strict=False))
        if any(abs(a - b) > STILL for a, b in zip(body.position, start.position, strict=True))
    )
    return moving or frozenset(range(_count(scene)))


def _count(scene: RecordedScene) -> int:
    """How many bodies there are: as many as in the fullest frame."""
    return max(len(frame.bodies) for frame in scene.frames)


def _reach(scene: RecordedScene, moving: frozenset[int]) -> Iterable[Vector]:
    for frame in scene.frames:
        yield from frame.arm
        for i, body in enumerate(frame.bodies):
            if i in moving:
                yield from corners(body)


def _draw(
    scene: RecordedScene, view: Projection, canvas: Canvas, moving: frozenset[int]
) -> Drawing:
    numbers = range(_count(scene))
    samples = [next(f.bodies[i] for f in scene.frames if i < len(f.bodies)) for i in numbers]
    shapes = [
        _shape(
            _hex(body),
            [
                body_paths(frame.bodies[i], view, canvas) if i < len(frame.bodies) else NOTHING
                for frame in scene.frames
            ],
        )
        for i, body in enumerate(samples)
    ]
    has_arm = any(frame.arm for frame in scene.frames)
    if has_arm:
        lines = [_line(frame, view, canvas) for frame in scene.frames]
        shapes.append(_shape("", lines))
    orders, order_at = _unique([_order(f, view, moving, samples, has_arm) for f in scene.frames])
    return Drawing(
        view.name,
        canvas.units_high,
        round(ARM_WIDTH_M * canvas.scale),
        tuple(shapes),
        orders,
        order_at,
    )


def _shape(fill: str, poses: Sequence[tuple[str, ...]]) -> AnimatedShape:
    return AnimatedShape(fill, *_unique(poses))


def _unique(values: Sequence[T]) -> tuple[tuple[T, ...], tuple[int, ...]]:
    """The different values, and which of them stands where."""
    numbers: dict[T, int] = {}
    at = tuple(numbers.setdefault(value, len(numbers)) for value in values)
    return tuple(numbers), at


def _line(frame: SceneFrame, view: Projection, canvas: Canvas) -> tuple[str, ...]:
    """The arm, for its outline and for its inside."""
    points: list[Point] = [view.project(point) for point in frame.arm]
    path = canvas.path(points, closed=False) if points else ""
    return (path, path)


def _order(
    frame: SceneFrame,
    view: Projection,
    moving: frozenset[int],
    samples: Sequence[VisibleBody],
    has_arm: bool,
) -> tuple[int, ...]:
    """The bodies from back to front; else those that stand still first, the largest before all."""

    def rank(number: int) -> tuple[bool, float]:
        if number == len(samples):
            return True, view.depth(frame.arm[-1]) if frame.arm else 0.0
        x, y, z = samples[number].size
        if number not in moving:
            return False, -x * y * z
        return True, view.depth(frame.bodies[number].position) if number < len(frame.bodies) else 0

    ranks = [rank(number) for number in range(len(samples) + has_arm)]
    return tuple(painting_order(frame.bodies, view, ranks))


def _hex(body: VisibleBody) -> str:
    """A body's colour as HTML has it."""
    parts = (round(255 * min(1.0, max(0.0, part))) for part in body.colour[:3])
    return "#" + "".join(f"{part:02x}" for part in parts)
