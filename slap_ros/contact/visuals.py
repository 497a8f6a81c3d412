# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a camera sees of the contact world: rigid links, made of parts, and where they are."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from slap_ros.contact.scene import ContactScene, CylinderPart, Part
from slap_ros.contact.snapshot import StateIndex
from slap_ros.geometry.pose import Pose
from slap_ros.physics.scene import Colour
from slap_ros.physics.visuals import Configuration, Cylinder, VisualShape
from slap_ros.relational import State

MOVING = "_moving"  # what the name of a jointed body's moving part ends with


class Link(NamedTuple):
    """Parts that move as one: a rigid body, or frame or moving part of a jointed one."""

    name: str
    parts: tuple[Part, ...]  # in its own frame
    colour: Colour  # of parts that have none of their own


class ContactVisuals:
    """The bodies of a scene, as :class:`~slap_ros.physics.visuals.Visuals`."""

    def __init__(self, scene: ContactScene) -> None:
        self._scene = scene

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """Free bodies, fixed ones with the floor last, frames, and moving parts."""
        scene = self._scene
        return (
            *(Link(body.name, body.parts, body.colour) for body in (*scene.free, *scene.fixed)),
            *(Link(body.name, body.frame, body.colour) for body in scene.jointed),
            *(
                Link(f"{body.name}{MOVING}", body.moving, body.moving_colour)
                for body in scene.jointed
            ),
        )

    def link_poses(self, state: State) -> list[Pose]:
        """Where the links are, in the base's frame."""
        index = StateIndex.of(self._scene, state.layout)
        snapshot, placement = index.read(state), index.placement(self._scene, state)
        moving = zip(self._scene.jointed, placement.jointed, snapshot.openings, strict=True)
        return [
            *(motion.pose for motion in snapshot.bodies),
            *placement.fixed,
            *placement.jointed,
            *(body.moving_pose(pose, opening.position) for body, pose, opening in moving),
        ]

    @cached_property
    def shapes(self) -> Sequence[VisualShape]:
        """See :class:`~slap_ros.physics.visuals.Visuals`."""
        return [_shape(part, link.colour) for link in self.links for part in link.parts]

    def configuration(self, state: State) -> Configuration:
        """See :class:`~slap_ros.physics.visuals.Visuals`."""
        snapshot = StateIndex.of(self._scene, state.layout).read(state)
        poses = [
            pose.compose(part.pose)
            for link, pose in zip(self.links, self.link_poses(state), strict=True)
            for part in link.parts
        ]
        return Configuration(snapshot.joints, snapshot.hand.fingers, poses)


def _shape(part: Part, colour: Colour) -> VisualShape:
    if isinstance(part, CylinderPart):
        return VisualShape(Cylinder(part.radius_m, part.length_m), part.colour or colour)
    return VisualShape(part.half_extents_m, part.colour or colour)
