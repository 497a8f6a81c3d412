# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a camera sees of the contact world: the parts of all links."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from slap_ros.relational import State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.links import link_poses, links
from slap_ros.worlds.contact.scene import ContactScene, CylinderPart, Part
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.visuals import Configuration, Cylinder, VisualShape


class ContactVisuals:
    """The bodies of a scene, as :class:`~slap_ros.worlds.visuals.Visuals`."""

    def __init__(self, scene: ContactScene) -> None:
        self._scene = scene

    @cached_property
    def shapes(self) -> Sequence[VisualShape]:
        """See :class:`~slap_ros.worlds.visuals.Visuals`."""
        return [_shape(part, link.colour) for link in links(self._scene) for part in link.parts]

    def configuration(self, state: State) -> Configuration:
        """See :class:`~slap_ros.worlds.visuals.Visuals`."""
        snapshot = ContactIndex.of(self._scene, state.layout).read(state)
        poses = [
            pose.compose(part.pose)
            for link, pose in zip(links(self._scene), link_poses(self._scene, state), strict=True)
            for part in link.parts
        ]
        return Configuration(snapshot.joints, snapshot.hand.fingers, poses)


def _shape(part: Part, colour: Colour) -> VisualShape:
    if isinstance(part, CylinderPart):
        return VisualShape(Cylinder(part.radius_m, part.length_m), part.colour or colour)
    return VisualShape(part.half_extents_m, part.colour or colour)
