# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a hand can go straight up from where it is without touching anything."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.worlds.contact.scene import ContactScene, Part
from slap_ros.worlds.contact.snapshot import ContactSnapshot, Placement

MARGIN = 0.001  # m, between the hand and what it passes
TIP = 0.002  # m, at the bottom of what may lean on something
RISE = 0.3  # m, more than anything on a table is high

Boxes = tuple[OrientedBox, ...]  # around the same part


def way_up_is_free(scene: ContactScene, snapshot: ContactSnapshot, placement: Placement) -> bool:
    """Whether a hand can go straight up without touching anything, its fingers as they are.

    Args:
        scene: Bodies of the scene.
        snapshot: Physics of the state.
        placement: Poses of the bodies that do not move.

    Returns:
        True also where it holds something, which goes up with it.
    """
    if snapshot.held is not None:
        return True
    swept = [_swept(box) for box in snapshot.hand.boxes()]
    shaft = _Shaft.around(swept)
    return not any(
        all(box.overlaps(way) for box in boxes)
        for boxes in _solids(scene, snapshot, placement, shaft)
        for way in swept
    )


def _swept(box: OrientedBox) -> OrientedBox:
    """What a box of a hand that points down passes through on its way up, less its lowest part."""
    (x, y, z), turn = box.pose
    length, width, height = box.half
    half = (length + MARGIN, width + MARGIN, height + 0.5 * (RISE - TIP))
    return OrientedBox(Pose((x, y, z + 0.5 * (RISE + TIP)), turn), half)


class _Shaft(NamedTuple):
    """A round shaft, upwards without end, around what is passed; most parts are outside of it."""

    axis: tuple[float, float]  # m
    radius: float  # m
    bottom: float  # m

    @classmethod
    def around(cls, boxes: Sequence[OrientedBox]) -> _Shaft:
        """The shaft around boxes that stand upright."""
        (x, y, _), _ = boxes[0].pose
        aside = [math.dist((x, y), box.pose.position[:2]) for box in boxes]
        radius = max(a + math.hypot(*box.half[:2]) for a, box in zip(aside, boxes, strict=True))
        bottom = min(box.pose.position[2] - box.half[2] for box in boxes)
        return cls((x, y), radius, bottom)

    def may_meet(self, part: Part, pose: Pose) -> bool:
        """Whether a ball around a part reaches into the shaft.

        Args:
            part: Part of a body.
            pose: Pose of the body.
        """
        ball = part.bounding_box
        x, y, z = pose.apply(ball.pose.position)
        radius = ball.radius
        if z + radius < self.bottom:
            return False
        u, v = self.axis
        return math.hypot(x - u, y - v) < self.radius + radius


def _solids(
    scene: ContactScene, snapshot: ContactSnapshot, placement: Placement, shaft: _Shaft
) -> Iterator[Boxes]:
    """What is around each part of each body that a shaft may meet."""
    for body, motion in zip(scene.free, snapshot.bodies, strict=True):
        yield from _boxes(body.parts, motion.pose, shaft)
    for fixed, pose in zip(scene.fixed, placement.fixed, strict=True):
        if fixed.solid:
            yield from _boxes(fixed.parts, pose, shaft)
    for jointed, pose, opening in zip(
        scene.jointed, placement.jointed, snapshot.openings, strict=True
    ):
        yield from _boxes(jointed.frame, pose, shaft)
        yield from _boxes(jointed.moving, jointed.moving_pose(pose, opening.position), shaft)


def _boxes(parts: Sequence[Part], pose: Pose, shaft: _Shaft) -> Iterator[Boxes]:
    for part in parts:
        if shaft.may_meet(part, pose):
            yield tuple(box.at(pose) for box in part.bounding_boxes)
