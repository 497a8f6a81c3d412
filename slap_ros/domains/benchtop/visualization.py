# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a person sees of hand, things, drawers and lids: markers, frames, animations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

from slap_ros.core import Display, VisibleBody
from slap_ros.domains.visualization import animation, arm_bodies
from slap_ros.geometry.pose import Pose, Vector
from slap_ros.meshes.solid import prism
from slap_ros.relational import State
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.links import Link, link_poses, links
from slap_ros.worlds.contact.scene import ContactScene, CylinderPart, Part
from slap_ros.worlds.contact.visuals import ContactVisuals
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.viewpoint import Viewpoint

SceneOf = Callable[[State], ContactScene]
VIEW = Viewpoint(eye=(1.12, -0.84, 0.66), target=(0.46, 0.0, 0.14))
SIDES = 12  # of the prism that a cylinder is shown as


def display(scene_of: SceneOf, view: Viewpoint = VIEW) -> Display:
    """How a domain of the contact world looks.

    Args:
        scene_of: Function from a state to its bodies.
        view: Viewpoint of animations.

    Returns:
        Every part of every body but the floor, the arm, the bodies' frames, and animations.
    """
    return Display(
        bodies=lambda state: visible_bodies(scene_of(state), state),
        arm=visible_arm,
        frames=lambda state: link_frames(scene_of(state), state),
        animate=animation(lambda state: ContactVisuals(scene_of(state)), CONTROL_PERIOD_S, view),
    )


def visible_bodies(scene: ContactScene, state: State) -> list[VisibleBody]:
    """Everything that stands around the robot, part by part; parts have the name of their body."""
    return [
        _visible(link, part, pose) for link, pose in _links(scene, state) for part in link.parts
    ]


def link_frames(scene: ContactScene, state: State) -> Mapping[str, Pose]:
    """Where bodies are, and the frames and moving parts of jointed ones, by name."""
    return {link.name: pose for link, pose in _links(scene, state)}


def visible_arm(state: State) -> list[VisibleBody]:
    """The arm and its hand: a box around each of their links."""
    (robot,) = state.layout.of_type(ROBOT)
    joints = [float(state.get(robot, feature.name)) for feature in JOINT_FEATURES]
    left, right = (float(state.get(robot, f"{side}_finger")) for side in ("left", "right"))
    return arm_bodies(joints, (left, right))


def _links(scene: ContactScene, state: State) -> list[tuple[Link, Pose]]:
    """All but the floor, which nobody wants to see from below."""
    placed = zip(links(scene), link_poses(scene, state), strict=True)
    floor = scene.fixed[-1].name
    return [(link, pose) for link, pose in placed if link.name != floor]


def _visible(link: Link, part: Part, pose: Pose) -> VisibleBody:
    x, y, z = part.bounding_box.half
    triangles = (
        prism_triangles(part.radius_m, part.length_m) if isinstance(part, CylinderPart) else ()
    )
    return VisibleBody(
        link.name,
        *pose.compose(part.pose),
        (2.0 * x, 2.0 * y, 2.0 * z),
        part.colour or link.colour,
        triangles,
    )


@lru_cache(maxsize=256)
def prism_triangles(radius_m: float, length_m: float) -> tuple[Vector, ...]:
    """The triangles that a cylinder about z is shown as, three corners each, m."""
    vertices, triangles = prism(radius_m, length_m, SIDES)
    return tuple(vertices[corner] for triangle in triangles for corner in triangle)
