# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of bodies at rest, corrected to where physics would have them.

A block measured 2 mm above the table neither floats nor is sunk in; left as measured it would fall
in the planner's model, and predicates of touching would flicker. What a camera saw at a wrong
height was seen at a wrong distance: it is put right along the line of sight, and so sideways too
(:mod:`slap_ros.worlds.joint_space.seen_supports`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.worlds.joint_space.seen_supports import StandingBody, SupportSearch


def resting_poses(
    measured: Mapping[int, Pose],
    bodies: Sequence[StandingBody],
    fixed: Sequence[OrientedBox],
    eyes: Mapping[int, Vector] | None = None,
) -> dict[int, Pose]:
    """Poses of bodies at rest, each flat on what supports it; as measured where that is unclear.

    Args:
        measured: Pose of each body at rest in the base's frame, by index among the bodies.
        bodies: The free bodies of the scene.
        fixed: The boxes of the solid bodies that do not move, base's frame.
        eyes: Where the camera is that saw a body, base's frame, for those that a camera saw.

    Returns:
        A pose for each measured one, by the same index.
    """
    search = SupportSearch(measured, bodies, eyes or {})
    return search.best(sorted(measured, key=lambda i: measured[i].position[2]), fixed)
