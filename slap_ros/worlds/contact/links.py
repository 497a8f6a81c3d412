# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rigid links that a scene is made of, and where they are in a state."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.worlds.bodies import Colour
from slap_ros.worlds.contact.scene import ContactScene, Part
from slap_ros.worlds.contact.snapshot import ContactIndex

MOVING = "_moving"  # what the name of a jointed body's moving part ends with


class Link(NamedTuple):
    """Parts that move as one: a rigid body, or frame or moving part of a jointed one."""

    name: str
    parts: tuple[Part, ...]  # in its own frame
    colour: Colour  # of parts that have none of their own
    solid: bool = True  # False for what only marks a place


@lru_cache(maxsize=64)
def links(scene: ContactScene) -> tuple[Link, ...]:
    """Free bodies, fixed ones with the floor last, frames, and moving parts."""
    rigid = (*scene.free, *scene.fixed)
    return (
        *(Link(body.name, body.parts, body.colour, body.solid) for body in rigid),
        *(Link(body.name, body.frame, body.colour) for body in scene.jointed),
        *(Link(f"{body.name}{MOVING}", body.moving, body.moving_colour) for body in scene.jointed),
    )


def link_poses(scene: ContactScene, state: State) -> list[Pose]:
    """Where the links are, in the base's frame."""
    index = ContactIndex.of(scene, state.layout)
    snapshot, placement = index.read(state), index.placement(scene, state)
    moving = zip(scene.jointed, placement.jointed, snapshot.openings, strict=True)
    return [
        *(motion.pose for motion in snapshot.bodies),
        *placement.fixed,
        *placement.jointed,
        *(body.moving_pose(pose, opening.position) for body, pose, opening in moving),
    ]
