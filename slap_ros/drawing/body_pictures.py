# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of bodies as a domain displays them: boxes and triangles, hidden by what is nearer.

A plain drawing for domains that have no animation of their own. Every pixel keeps the nearest
face (a depth buffer); faces are shaded by their direction and outlined. The picture is drawn at
twice its size and made smaller, which smooths all edges.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Display, PictureSize, VisibleBody
from slap_ros.drawing.projection import (
    AXES,
    LIGHT,
    OBLIQUE,
    SIDE,
    TOP,
    Canvas,
    Projection,
    box_triangles,
    corners,
    drawable,
    pose_of,
)
from slap_ros.geometry.pose import rotate
from slap_ros.relational import State
from slap_ros.worlds.animation import Picture, write_pictures

SIZE = PictureSize(640, 480)
SMOOTHING = 2  # pixels drawn for each of the picture, along each edge
MARGIN = 0.08  # around what moves, of its extent
SURROUNDINGS = 2.0  # bodies up to so much larger than the extent of what moves are shown whole
STILL = 1e-4  # m: bodies that move less do not decide what is shown
PAPER = (0.97, 0.97, 0.98)  # the background, red green blue
AMBIENT = 0.6  # brightness of a face that the light does not reach
OUTLINE = 0.45  # brightness of outlines, against their face
SAME_PLANE = 1e-6  # m
OPAQUE = 0.99  # opacity from which on nothing is seen through a body

Floats = NDArray[np.float64]


def write_body_animation(
    path: Path,
    display: Display,
    states: Sequence[State],
    period_s: float,
    size: PictureSize,
    progress: Callable[[int], None],
) -> None:
    """Write an animation of the bodies of a domain, one frame per state.

    Args:
        path: Path of the file; its ending says the format, see ``slap_ros.worlds.animation``.
        display: Display that shows bodies, the arm among them.
        states: States, one per frame; not empty.
        period_s: Duration of each frame, s.
        size: Size of the frames, pixels.
        progress: Function that receives the number of frames drawn so far, after each.

    Raises:
        OSError: It cannot be written.
    """
    scenes = [visible(display, state) for state in states]
    view = viewpoint(scenes)
    canvas = canvas_of(scenes, view, size)

    def pictures() -> Iterator[Picture]:
        for done, bodies in enumerate(scenes, start=1):
            yield draw_bodies(bodies, view, canvas, size)
            progress(done)

    write_pictures(path, pictures(), period_s)


def visible(display: Display, state: State) -> list[VisibleBody]:
    """Everything that is shown of a state and can be drawn."""
    return list(drawable((*display.bodies(state), *display.arm(state))))


def viewpoint(scenes: Sequence[Sequence[VisibleBody]]) -> Projection:
    """The view from the front right; a world that is itself flat is seen squarely."""
    places = np.array([body.position for bodies in scenes for body in bodies])
    if len(places) and np.ptp(places[:, 1]) < STILL:
        return SIDE
    return TOP if len(places) and np.ptp(places[:, 2]) < STILL else OBLIQUE


def canvas_of(
    scenes: Sequence[Sequence[VisibleBody]], view: Projection, size: PictureSize
) -> Canvas:
    """The part of the view with all that moves and what is not much larger, in the picture's shape.

    Args:
        scenes: Bodies of each picture.
        view: Projection that the bodies are seen in.
        size: Size of the pictures, pixels.
    """
    points = [
        np.array([[view.project(corner) for corner in corners(body)] for body in bodies])
        for bodies in scenes
    ]
    flat = np.concatenate([one.reshape(-1, 8, 2) for one in points])
    moving = [p for one in points[1:] for p in _moved(points[0], one)] or [flat]
    extent = np.ptp(np.concatenate([p.reshape(-1, 2) for p in moving]), axis=0).max()
    small = np.ptp(flat, axis=1).max(axis=1) <= SURROUNDINGS * extent
    shown = np.concatenate([*(p.reshape(-1, 2) for p in moving), flat[small].reshape(-1, 2)])
    canvas = Canvas.around(map(tuple, shown.tolist()), MARGIN)
    width = max(canvas.width, canvas.height * size.width / size.height)
    height = width * size.height / size.width
    return Canvas(
        canvas.left - (width - canvas.width) / 2,
        canvas.top + (height - canvas.height) / 2,
        width,
        height,
    )


def _moved(first: Floats, now: Floats) -> list[Floats]:
    """The corners of the bodies that are not where they were, before and after."""
    if first.shape != now.shape:
        return [first, now]
    moved = np.abs(first - now).reshape(len(first), -1).max(axis=1) > STILL
    return [first[moved], now[moved]] if moved.any() else []


def draw_bodies(
    bodies: Sequence[VisibleBody], view: Projection, canvas: Canvas, size: PictureSize
) -> Picture:
    """Draw bodies, the nearer ones before the farther ones.

    Args:
        bodies: Bodies that can be drawn.
        view: Projection that the bodies are seen in.
        canvas: Part of the view that is drawn, in the shape of the picture.
        size: Size of the picture, pixels.

    Returns:
        Shape (height, width, 3).
    """
    sheet = _Sheet.empty(size.width * SMOOTHING, size.height * SMOOTHING)
    for body in sorted(bodies, key=lambda body: _rank(body, view)):
        _draw_body(sheet, body, view, canvas)
    from PIL import Image  # with the physics: those who render nothing need none of it

    large = Image.fromarray(sheet.outlined())
    return np.asarray(large.resize(size, Image.Resampling.BOX))


def _rank(body: VisibleBody, view: Projection) -> tuple[bool, float]:
    """Solid bodies first, the largest before all: of faces in one plane the last is seen."""
    if body.colour[3] < OPAQUE:
        return True, view.depth(body.position)
    return False, -float(np.prod(body.size))


def _draw_body(sheet: _Sheet, body: VisibleBody, view: Projection, canvas: Canvas) -> None:
    axes = np.array([view.right, view.up, view.toward])
    scale = sheet.width / canvas.width  # pixels per m
    triangles, faces = _triangles(body)
    seen = triangles @ axes.T
    x = (seen[..., 0] - canvas.left) * scale
    y = (canvas.top - seen[..., 1]) * scale
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals[normals @ axes[2] < 0.0] *= -1.0  # toward the viewer
    first = sheet.next_face(int(faces.max()) + 1)
    for i in np.flatnonzero(lengths > 0.0):
        lit = max(0.0, float(normals[i] @ np.array(LIGHT)) / float(lengths[i]))
        colour = np.array(body.colour[:3]) * (AMBIENT + (1.0 - AMBIENT) * lit)
        corners_px = np.stack([x[i], y[i], seen[i, :, 2]], axis=-1)
        sheet.fill(corners_px, colour, body.colour[3], first + int(faces[i]))


def _triangles(body: VisibleBody) -> tuple[Floats, NDArray[np.int_]]:
    """Triangles of a body, m in the world frame, shape (n, 3, 3); the face that each is part of."""
    if not body.triangles:
        return np.array(box_triangles(body)), np.arange(12) // 2
    local = np.array(body.triangles, dtype=np.float64).reshape(-1, 3, 3)
    turn = np.array([rotate(pose_of(body).quaternion, axis) for axis in AXES])
    return local @ turn + body.position, np.zeros(len(local), dtype=np.int_)


@dataclass
class _Sheet:
    """Pixels with the depth and the face that each shows."""

    colours: NDArray[np.float32]  # (height, width, 3), 0 to 1
    depths: Floats  # m toward the viewer
    faces: NDArray[np.int_]  # 0: the background
    _faces: int = field(default=1)

    @classmethod
    def empty(cls, width: int, height: int) -> _Sheet:
        """A sheet with nothing but background."""
        shape = (height, width)
        colours = np.full((*shape, 3), PAPER, dtype=np.float32)
        return cls(colours, np.full(shape, -np.inf), np.zeros(shape, dtype=int))

    @property
    def width(self) -> int:
        """The width in pixels."""
        return int(self.depths.shape[1])

    def next_face(self, count: int) -> int:
        """The first of so many new numbers of faces."""
        self._faces += count
        return self._faces - count

    def fill(self, triangle: Floats, colour: Floats, opacity: float, face: int) -> None:
        """Draw a triangle where nothing nearer is.

        Args:
            triangle: x and y in pixels, and m toward the viewer; shape (3, 3).
            colour: Red green blue, 0 to 1.
            opacity: Below 1, what is behind it is seen as well.
            face: A number of its own for what has one outline.
        """
        low = np.floor(triangle[:, :2].min(axis=0)).clip(0).astype(int)
        high = np.ceil(triangle[:, :2].max(axis=0)).clip(0, self.depths.shape[::-1]).astype(int)
        (ax, ay, _), (bx, by, _), (cx, cy, _) = triangle
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if (low >= high).any() or abs(area) < 1e-9:
            return
        x = np.arange(low[0], high[0]) + 0.5
        y = np.arange(low[1], high[1])[:, None] + 0.5
        second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
        third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
        first = 1.0 - second - third
        depth = first * triangle[0, 2] + second * triangle[1, 2] + third * triangle[2, 2]
        part = (slice(low[1], high[1]), slice(low[0], high[0]))
        inside = (first >= 0.0) & (second >= 0.0) & (third >= 0.0)
        inside &= depth > self.depths[part] - SAME_PLANE
        behind = self.colours[part][inside]
        self.colours[part][inside] = opacity * colour + (1.0 - opacity) * behind
        if opacity >= OPAQUE:
            self.depths[part][inside] = depth[inside]
            self.faces[part][inside] = face

    def outlined(self) -> Picture:
        """The picture with a line wherever another face begins."""
        edge = np.zeros(self.depths.shape, dtype=bool)
        edge[:, 1:] |= self.faces[:, 1:] != self.faces[:, :-1]
        edge[1:] |= self.faces[1:] != self.faces[:-1]
        shown = np.where(edge[..., None], OUTLINE * self.colours, self.colours)
        picture: Picture = np.rint(255.0 * shown.clip(0.0, 1.0)).astype(np.uint8)
        return picture
