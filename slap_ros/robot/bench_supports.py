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
from slap_ros.worlds.settling import FLOATING, levelled

PRESSED = 0.005  # m, by which what is carried may seem to be inside what it is put down on


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

    Returns:
        The free bodies in the same order.
    """
    measured = {i: bodies[i].pose for i in eyes}
    fixed = list(_supports(scene, placement, openings))
    found = resting_poses(measured, scene.free, fixed, eyes)
    return tuple(one._replace(pose=found.get(i, one.pose)) for i, one in enumerate(bodies))


def moving_support(
    scene: ContactScene, parts: Sequence[Pose], index: int, pose: Pose
) -> int | None:
    """The drawer or lid on whose moving part a body lies.

    Args:
        scene: Bodies of the scene.
        parts: Poses of the moving parts of the jointed bodies.
        index: Index of the body.
        pose: Pose of the body.

    Returns:
        Index among the jointed bodies; None where it lies on none of them.
    """
    box = scene.free[index].at(pose)
    for k, (jointed, part) in enumerate(zip(scene.jointed, parts, strict=True)):
        for other in _boxes(jointed.moving, part):
            if _is_over(box, other) and abs(box.bottom - other.top) <= FLOATING:
                return k
    return None


def lifted_out(
    scene: ContactScene,
    placement: Placement,
    bodies: Sequence[BodyState],
    openings: Sequence[Opening],
    carried: int,
) -> Pose:
    """The pose of a carried body, raised out of what it is put down on.

    A hand that goes on down while its fingers close, or while it presses on a support, has the body
    higher up than before; and a camera does not say how far away the body is.

    Args:
        scene: Bodies of the scene.
        placement: Poses of the bodies that do not move.
        bodies: How the free bodies lie or move.
        openings: How far drawers and lids are open.
        carried: Index of the body.
    """
    pose, below = bodies[carried].pose, list(_supports(scene, placement, openings))
    for i, one in enumerate(bodies):
        if i != carried and one.still:
            below += _boxes(scene.free[i].parts, one.pose)
    box = scene.free[carried].at(levelled(pose) or pose)
    inside = (other.top - box.bottom for other in below if _is_over(box, other))
    rise = max((one for one in inside if 0.0 < one <= PRESSED), default=0.0)
    x, y, z = pose.position
    return Pose((x, y, z + rise), pose.quaternion)


def _is_over(box: OrientedBox, other: OrientedBox) -> bool:
    """Whether a box's middle is over another box."""
    x, y, _ = box.pose.position
    there = other.pose.inverse().apply((x, y, other.pose.position[2]))
    return all(abs(a) <= half for a, half in zip(there, other.half, strict=True))


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
