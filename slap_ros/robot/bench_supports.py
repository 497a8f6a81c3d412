# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What things at a bench stand on, where a camera says only roughly how far away they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.worlds.contact.scene import ContactScene, Part
from slap_ros.worlds.contact.snapshot import Opening, Placement
from slap_ros.worlds.joint_space.settling import resting_poses
from slap_ros.worlds.layout_index import BodyState


def put_down(
    scene: ContactScene,
    placement: Placement,
    bodies: Sequence[BodyState],
    openings: Sequence[Opening],
    eyes: Mapping[int, Vector],
) -> tuple[BodyState, ...]:
    """Things as they were measured, those at rest moved along the line of sight to a support.

    Args:
        scene: Bodies of the scene.
        placement: Poses of the bodies that do not move.
        bodies: How the free bodies lie or move.
        openings: How far drawers and lids are open.
        eyes: Where the camera is that saw a body at rest, by its index; others stay as they are.
    """
    measured = {i: bodies[i].pose for i in eyes}
    fixed = list(_supports(scene, placement, openings))
    found = resting_poses(measured, scene.free, fixed, eyes)
    return tuple(one._replace(pose=found.get(i, one.pose)) for i, one in enumerate(bodies))


def _supports(
    scene: ContactScene, placement: Placement, openings: Sequence[Opening]
) -> Iterator[OrientedBox]:
    """Boxes around the parts of everything that does not move by itself."""
    for body, pose in zip(scene.fixed, placement.fixed, strict=True):
        if body.solid:
            yield from _boxes(body.parts, pose)
    for jointed, pose, opening in zip(scene.jointed, placement.jointed, openings, strict=True):
        yield from _boxes(jointed.frame, pose)
        yield from _boxes(jointed.moving, jointed.moving_pose(pose, opening.position))


def _boxes(parts: Sequence[Part], pose: Pose) -> Iterator[OrientedBox]:
    return (part.bounding_box.at(pose) for part in parts)
