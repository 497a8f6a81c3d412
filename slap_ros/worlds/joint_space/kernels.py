# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The arm and its way in a control step, as compiled code: the arithmetic of ``arm.py``.

Where a comment is missing here, it is there: each function has its name, and the same bits. A pose
is a row of seven numbers: x, y, z in m, and a quaternion x y z w. An arm is an array with a row for
each link that can touch something, and for the held body: the pose of the link, then that of the
box around it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slap_ros.compilation import compiled, inner
from slap_ros.geometry import oriented_box, pose
from slap_ros.geometry.pose import Quaternion, Vector
from slap_ros.relational.state import Array
from slap_ros.worlds.joint_space.arm import (
    CLEARANCE,
    HELD_DEPTH,
    LINK_DEPTH,
    SAMPLING,
    SPACINGS,
)
from slap_ros.worlds.joint_space.drive import LEAST_SINE
from slap_ros.worlds.joint_space.links import LINK_SHAPES
from slap_ros.worlds.panda import (
    CONTROL_PERIOD_S,
    FINGER_HEIGHT,
    HALF_TURN_Z,
    HAND,
    HAND_FRAME,
    JOINT_FRAMES,
    JOINTS,
    LINKS,
    SQRT_HALF,
)

PlainPose = tuple[Vector, Quaternion]
PlainBox = tuple[PlainPose, Vector]  # and half its edges, m

PARALLEL = oriented_box.PARALLEL
LEFT, RIGHT = LINKS.index("left_finger"), LINKS.index("right_finger")
CARRIERS = np.array([shape.link for shape in LINK_SHAPES])
HELD = len(LINK_SHAPES)  # row of the held body
ORIGINS = np.array([origin for origin, _ in JOINT_FRAMES])
QUARTERS = np.array([float(quarter) for _, quarter in JOINT_FRAMES])
HAND_PLACE, HAND_TURN = HAND_FRAME

rotate = inner(pose.rotate)
multiply = inner(pose.multiply)
conjugate = inner(pose.conjugate)
rotation_matrix = inner(pose.rotation_matrix)


class LinkBoxes(NamedTuple):
    """The boxes around the links, and around the held body where there is one."""

    frames: Array  # of the boxes in the links, shape (links, 7)
    halves: Array  # half their edges, m, shape (links, 3)
    radii: Array  # half their diagonals, m, shape (links,)


class BoxRows(NamedTuple):
    """Boxes that stand still."""

    poses: Array  # shape (boxes, 7)
    halves: Array  # half their edges, m, shape (boxes, 3)
    radii: Array  # half their diagonals, m, shape (boxes,)
    tops: Array  # heights of their highest points, m, shape (boxes,)


@inner
def _pose(row: Array) -> PlainPose:
    return (row[0], row[1], row[2]), (row[3], row[4], row[5], row[6])


@inner
def _vector(row: Array) -> Vector:
    return row[0], row[1], row[2]


@inner
def _put(row: Array, placed: PlainPose) -> None:
    position, turn = placed
    row[0], row[1], row[2] = position
    row[3], row[4], row[5], row[6] = turn


@inner
def _apply(frame: PlainPose, point: Vector) -> Vector:
    x, y, z = rotate(frame[1], point)
    return frame[0][0] + x, frame[0][1] + y, frame[0][2] + z


@inner
def _compose(outer: PlainPose, frame: PlainPose) -> PlainPose:
    return _apply(outer, frame[0]), multiply(outer[1], frame[1])


@compiled
def place(joints: Array, finger: float, grasp: Array, boxes: LinkBoxes) -> Array:
    """The arm in one configuration.

    Args:
        joints: Joint positions, rad, shape (7,).
        finger: Distance of each finger from the middle, m.
        grasp: Pose of the held body in the hand's frame, shape (7,).
        boxes: Boxes around the links, and around the held body where there is one.

    Returns:
        Shape (links, 14).
    """
    links = np.empty((len(LINKS), 7))
    _place_links(joints, finger, links)
    arm = np.empty((len(boxes.radii), 14))
    for i in range(len(arm)):
        link = _pose(links[HAND if i == HELD else CARRIERS[i]])
        if i == HELD:
            link = _compose(link, _pose(grasp))
        _put(arm[i, :7], link)
        _put(arm[i, 7:], _compose(link, _pose(boxes.frames[i])))
    return arm


@inner
def _place_links(joints: Array, finger: float, links: Array) -> None:
    """Write the poses of all links, as :func:`slap_ros.worlds.panda.link_poses`."""
    position, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    _put(links[0], (position, turn))
    for joint in range(JOINTS):
        dx, dy, dz = rotate(turn, _vector(ORIGINS[joint]))
        position = (position[0] + dx, position[1] + dy, position[2] + dz)
        c, s = math.cos(0.5 * joints[joint]), math.sin(0.5 * joints[joint])
        quarter = QUARTERS[joint]
        if quarter != 0.0:
            along = quarter * SQRT_HALF
            turn = multiply(turn, (along * c, -along * s, SQRT_HALF * s, SQRT_HALF * c))
        else:
            turn = multiply(turn, (0.0, 0.0, s, c))
        _put(links[joint + 1], (position, turn))
    hand = _compose((position, turn), (HAND_PLACE, HAND_TURN))
    _put(links[HAND], hand)
    _put(links[LEFT], (_apply(hand, (0.0, finger, FINGER_HEIGHT)), hand[1]))
    right = _apply(hand, (0.0, -finger, FINGER_HEIGHT))
    _put(links[RIGHT], (right, multiply(hand[1], HALF_TURN_Z)))


@inner
def _distance(a: Vector, b: Vector) -> float:
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


@inner
def _travel(start: Array, end: Array, radius: float) -> float:
    """How far any point of a link goes at most, m; ``start``, ``end``: rows of an arm."""
    p, q = _pose(start)[1], _pose(end)[1]
    cosine = abs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3])
    angle = 2.0 * math.acos(min(1.0, cosine))
    return _distance(_vector(start[7:]), _vector(end[7:])) + angle * radius


@compiled
def stays_clear(start: Array, end: Array, links: LinkBoxes, around: BoxRows) -> bool:
    """Whether no link comes near any of the boxes on its way.

    Args:
        start: Arm at the beginning, shape (links, 14).
        end: Arm at the end, of the same shape.
        links: Boxes around the links.
        around: Boxes to stay clear of.
    """
    highest = -np.inf
    for j in range(len(around.radii)):
        highest = max(highest, around.poses[j, 2] + around.radii[j])
    for i in range(len(start) - 1, -1, -1):
        radius = links.radii[i]
        travel = _travel(start[i], end[i], radius)
        margin = CLEARANCE + 0.5 * travel
        if min(start[i, 9], end[i, 9]) - margin - radius > highest:
            continue
        for j in range(len(around.radii)):
            centre, distance = _vector(around.poses[j]), margin + around.radii[j]
            half = _vector(links.halves[i])
            is_near = _is_link_near(start[i], half, radius, centre, distance) or _is_link_near(
                end[i], half, radius, centre, distance
            )
            if is_near and _touches(i, start, end, travel, links, around, j):
                return False
    return True


@inner
def _is_link_near(link: Array, half: Vector, radius: float, point: Vector, distance: float) -> bool:
    box = _pose(link[7:])
    return _distance(point, box[0]) < distance + radius and _is_near(box, half, point, distance)


@inner
def _is_near(box: PlainPose, half: Vector, point: Vector, distance: float) -> bool:
    """Whether a point is within a distance of a box."""
    position, turn = box
    inside = (point[0] - position[0], point[1] - position[1], point[2] - position[2])
    x, y, z = rotate(conjugate(turn), inside)
    squared = 0.0
    for beyond in (abs(x) - half[0], abs(y) - half[1], abs(z) - half[2]):
        if beyond > 0.0:
            squared += beyond * beyond
    return squared < distance * distance


@inner
def _touches(
    link: int,
    start: Array,
    end: Array,
    travel: float,
    links: LinkBoxes,
    around: BoxRows,
    number: int,
) -> bool:
    """Whether a link comes near a box anywhere on its way; at ever finer steps."""
    box, (a, b, c) = _pose(around.poses[number]), _vector(around.halves[number])
    half, frame = _vector(links.halves[link]), _pose(links.frames[link])
    for spacing in SPACINGS:
        samples = max(math.ceil(travel / spacing), 1)
        margin = CLEARANCE + 0.5 * travel / samples
        grown = (a + margin, b + margin, c + margin)
        touches = False
        for k in range(samples, -1, -1):
            placed = _box_at(start[link], end[link], frame, k, samples)
            if _overlap(box, grown, placed, half):
                touches = True
                break
        if not touches:
            return False
    return True


@compiled
def hits(start: Array, end: Array, links: LinkBoxes, obstacles: BoxRows) -> bool:
    """Whether the arm enters an obstacle deeper than it may, at the end of its way.

    Args:
        start: Arm at the beginning, shape (links, 14).
        end: Arm at the end, of the same shape.
        links: Boxes around the links.
        obstacles: Fixed bodies.
    """
    for i in range(len(start)):
        travel = _travel(start[i], end[i], links.radii[i])
        centre, reach = _vector(end[i, 7:]), links.radii[i] + travel
        frame, own = _pose(links.frames[i]), _vector(links.halves[i])
        depth = HELD_DEPTH if i == HELD else LINK_DEPTH
        for j in range(len(obstacles.radii)):
            if not centre[2] - reach < obstacles.tops[j]:
                continue
            box, half = _pose(obstacles.poses[j]), _vector(obstacles.halves[j])
            if _is_near(box, half, centre, reach):
                spacing = max(2.0 * min(half), SAMPLING)
                samples = max(math.ceil(travel / spacing), 1)
                core = box, _shrunk(half, depth)
                if _enters(start[i], end[i], samples, core, (frame, own)):
                    return True
    return False


@inner
def _shrunk(half: Vector, depth: float) -> Vector:
    return max(half[0] - depth, 0.0), max(half[1] - depth, 0.0), max(half[2] - depth, 0.0)


@inner
def _enters(start: Array, end: Array, samples: int, core: PlainBox, link: PlainBox) -> bool:
    box, half = core
    frame, own = link
    for k in range(1, samples + 1):
        if _overlap(box, half, _box_at(start, end, frame, k, samples), own):
            return True
    return False


@inner
def _box_at(start: Array, end: Array, frame: PlainPose, k: int, samples: int) -> PlainPose:
    """The pose of the box around a link after ``k / samples`` of its way."""
    if k == samples:
        return _pose(end[7:])
    part = k / samples
    (p, q), (u, v) = _pose(start), _pose(end)
    sign = math.copysign(1.0, q[0] * v[0] + q[1] * v[1] + q[2] * v[2] + q[3] * v[3])
    x, y = q[0] + part * (sign * v[0] - q[0]), q[1] + part * (sign * v[1] - q[1])
    z, w = q[2] + part * (sign * v[2] - q[2]), q[3] + part * (sign * v[3] - q[3])
    length = math.sqrt(x * x + y * y + z * z + w * w)
    place = (
        p[0] + part * (u[0] - p[0]),
        p[1] + part * (u[1] - p[1]),
        p[2] + part * (u[2] - p[2]),
    )
    return _compose((place, (x / length, y / length, z / length, w / length)), frame)


@inner
def _overlap(box: PlainPose, half: Vector, other: PlainPose, other_half: Vector) -> bool:
    """Whether two boxes share a point; see :meth:`OrientedBox.overlaps`."""
    turn = conjugate(box[1])
    p, q = box[0], other[0]
    x, y, z = rotate(turn, (q[0] - p[0], q[1] - p[1], q[2] - p[2]))
    (a, b, c), (e, f, g) = half, other_half
    rows = rotation_matrix(multiply(turn, other[1]))
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rows
    if abs(z) > c + abs(r20) * e + abs(r21) * f + abs(r22) * g:
        return False
    if abs(x) > a + abs(r00) * e + abs(r01) * f + abs(r02) * g:
        return False
    if abs(y) > b + abs(r10) * e + abs(r11) * f + abs(r12) * g:
        return False
    columns = ((r00, r10, r20), (r01, r11, r21), (r02, r12, r22))
    for i in range(3):
        u, v, w = columns[i]
        if abs(x * u + y * v + z * w) > other_half[i] + a * abs(u) + b * abs(v) + c * abs(w):
            return False
    return not _edges_separate(half, other_half, (x, y, z), columns)


@inner
def _edges_separate(
    a: Vector, b: Vector, offset: Vector, columns: tuple[Vector, Vector, Vector]
) -> bool:
    x, y, z = offset
    for u, v, w in columns:
        for ax, ay, az in ((0.0, -w, v), (w, 0.0, -u), (-v, u, 0.0)):
            if ax * ax + ay * ay + az * az < PARALLEL:
                continue
            reach = a[0] * abs(ax) + a[1] * abs(ay) + a[2] * abs(az)
            for i in range(3):
                p, q, r = columns[i]
                reach += b[i] * abs(ax * p + ay * q + az * r)
            if abs(ax * x + ay * y + az * z) > reach:
                return True
    return False


@compiled
def deepest(
    start: Array, end: Array, links: LinkBoxes, obstacles: BoxRows, held_depth: float
) -> tuple[int, Vector, float]:
    """Where the arm would be deepest in an obstacle, seen from above.

    Args:
        start: Arm at the beginning, shape (links, 14).
        end: Arm at the end, of the same shape.
        links: Boxes around the links.
        obstacles: Fixed bodies.
        held_depth: How far a held body may reach into one, m.

    Returns:
        The link, a point of it, m, and by how much it has to be raised, m; no link, -1, where the
        arm is in no obstacle.
    """
    deepest_link, point, most = -1, (0.0, 0.0, 0.0), 0.0
    for i in range(len(start)):
        travel = _travel(start[i], end[i], links.radii[i])
        centre, reach = _vector(end[i, 7:]), links.radii[i] + travel
        frame, own = _pose(links.frames[i]), _vector(links.halves[i])
        depth = held_depth if i == HELD else LINK_DEPTH
        for j in range(len(obstacles.radii)):
            box, half = _pose(obstacles.poses[j]), _vector(obstacles.halves[j])
            if not _is_near(box, half, centre, reach):
                continue
            samples = max(math.ceil(travel / max(2.0 * min(half), SAMPLING)), 1)
            if _enters(start[i], end[i], samples, (box, _shrunk(half, depth)), (frame, own)):
                lowest = _lowest_corner(_pose(end[i, 7:]), own)
                below = obstacles.tops[j] - depth - lowest[2]
                if below > most:
                    deepest_link, point, most = i, lowest, below
    return deepest_link, point, most


@inner
def _lowest_corner(box: PlainPose, half: Vector) -> Vector:
    """The first of the lowest corners, in the order of :meth:`OrientedBox.corners`."""
    x, y, z = half
    lowest = _apply(box, (-x, -y, -z))
    for a in (-x, x):
        for b in (-y, y):
            for c in (-z, z):
                corner = _apply(box, (a, b, c))
                if corner[2] < lowest[2]:
                    lowest = corner
    return lowest


@compiled
def velocities(start: Array, end: Array) -> Array:
    """The velocities of links that go from one pose to another in a control period.

    Args:
        start: Arm at the beginning, shape (links, 14).
        end: Arm at the end, of the same shape.

    Returns:
        Linear velocity in m/s and angular velocity in rad/s of each link, shape (links, 6).
    """
    found = np.empty((len(start), 6))
    for i in range(len(start)):
        (a, p), (b, q) = _pose(start[i]), _pose(end[i])
        x, y, z, w = multiply(q, conjugate(p))
        sine = math.sqrt(x * x + y * y + z * z)
        rate = 0.0
        if not sine < LEAST_SINE:
            rate = 2.0 * math.atan2(sine, abs(w)) / sine / CONTROL_PERIOD_S
        rate = math.copysign(rate, w)
        for axis in range(3):
            found[i, axis] = (b[axis] - a[axis]) / CONTROL_PERIOD_S
        found[i, 3], found[i, 4], found[i, 5] = x * rate, y * rate, z * rate
    return found
