# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the hand has room: what scenes are checked for before they become tasks. Lengths in m."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.domains.benchtop.hand_motion import HandGoal
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.hand import PALM, STEM, pointing_down
from slap_ros.worlds.panda import FINGER_OPEN

ROOM = 0.03  # on all sides of a hand: an approach ends up to 25 mm aside
HIGHEST = 0.32  # up to which the hand must get, to pass over other things
BELOW = 0.006  # under the grasp point, what the fingers fill; less than they reach
STEM_TOP = STEM.half_extents_m[2] - STEM.pose.position[2]  # over the grasp point
STEM_REACH = STEM.half_extents_m[1] + STEM.pose.position[1] + FINGER_OPEN
PALM_BOTTOM = -PALM.pose.position[2] - PALM.half_extents_m[2]


@dataclass(frozen=True)
class Station:
    """The space that a body fills, and the space around the hand that acts there.

    Args:
        body: Boxes that the body fills where it stands, or may stand later.
        hand: Boxes around the hands that grasp the body or put something down there.
    """

    body: tuple[OrientedBox, ...]
    hand: tuple[OrientedBox, ...] = ()

    def leaves_room(self, other: Station) -> bool:
        """Whether neither body is in another or in a hand's way."""
        return not (
            _overlap(self.body, other.body)
            or _overlap(self.hand, other.body)
            or _overlap(other.hand, self.body)
        )


def palm_space(pose: Pose, bottom: float = PALM_BOTTOM) -> OrientedBox:
    """The space around the palm of a hand that is open.

    Args:
        pose: Pose of the grasp point, upright: z upwards, fingers along y.
        bottom: Height over the grasp point at which the space begins.
    """
    x, y, z = PALM.half_extents_m
    top = PALM_BOTTOM + 2.0 * z
    half = (x + ROOM, y + ROOM, 0.5 * (top - bottom))
    return OrientedBox(pose.compose(Pose((0.0, 0.0, 0.5 * (top + bottom)))), half)


def finger_space(pose: Pose) -> OrientedBox:
    """The space around open fingers, and between them.

    Args:
        pose: Pose of the grasp point, upright: z upwards, fingers along y.
    """
    half = (STEM.half_extents_m[0] + ROOM, STEM_REACH + ROOM, 0.5 * (STEM_TOP + BELOW))
    return OrientedBox(pose.compose(Pose((0.0, 0.0, 0.5 * (STEM_TOP - BELOW)))), half)


def upright(goal: HandGoal) -> Pose:
    """The grasp point's frame with z upwards."""
    return Pose(goal.position, from_yaw(goal.yaw))


def within_reach(goal: HandGoal, room: float = ROOM) -> bool:
    """Whether the arm gets its hand there, around there, and over it.

    Args:
        goal: Goal of the hand where it acts.
        room: Distance from the goal, along x and y, up to which the arm must reach as well, m.
    """
    x, y, z = goal.position
    turn = pointing_down(goal.yaw)
    return all(
        arm_joints(Pose((x + dx, y + dy, height), turn)) is not None
        for dx in (-room, room)
        for dy in (-room, room)
        for height in (z, HIGHEST)
    )


def _overlap(some: tuple[OrientedBox, ...], others: tuple[OrientedBox, ...]) -> bool:
    return any(one.overlaps(other) for one in some for other in others)
