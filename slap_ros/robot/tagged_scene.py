# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags on the objects of a scene: the scene file that bridge, detector and renderer read.

Every flat face of an object has tags, since the hand or another object may hide some. An object is
where any of its tags says; several in one picture count as their mean. Of a drawer or a lid, the
part that opens has the tags.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from slap_ros.core import Domain
from slap_ros.errors import InvalidSceneError
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Object, State
from slap_ros.robot.scene_config import SceneConfig, moving_name, opens, sampled_scene_config
from slap_ros.robot.tag_places import SMALLEST_PLACED, tag_places
from slap_ros.vision.tags import SHARE_OF_FACE, tag_frame, tag_of_frame
from slap_ros.worlds.contact.features import DRAWER_FEATURES
from slap_ros.worlds.contact.features import ROBOT as HAND_OF_FORCES
from slap_ros.worlds.contact.scene import BoxPart, Part
from slap_ros.worlds.contact.world import ContactWorld
from slap_ros.worlds.features import POSE_FEATURES, VELOCITY_FEATURES, pose_of
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import Box
from slap_ros.worlds.joint_space.world import PandaWorld

ROBOTS = (ROBOT, HAND_OF_FORCES)
SMALLEST_TAG = 0.01  # m; smaller ones are not seen across a table
DECIMALS = 9  # of numbers in the file
HALF_SIZES = ("half_x", "half_y", "half_z")  # features of a box


@dataclass(frozen=True)
class PlacedTag:
    """A tag on an object.

    Args:
        tag: Number of the tag.
        size: Edge of its black square, m.
        obj: Object that it is on; where that opens, the tag is on the part that does.
        pose: Pose of the tag in the frame of the object, or of that part.
    """

    tag: int
    size: float
    obj: Object
    pose: Pose

    @property
    def body(self) -> str:
        """The name of the body that it is on."""
        return moving_name(self.obj)


def placed_tags(config: SceneConfig) -> list[PlacedTag]:
    """The tags of a scene.

    Args:
        config: Scene as its file describes it.

    Raises:
        InvalidSceneError: A frame is no tag's, or of another family; or a tag is there twice, has
            no size, or one that does not fit on the object.
    """
    tags: dict[int, PlacedTag] = {}
    for obj, frames in config.detected.items():
        for how in frames:
            tag = tag_of_frame(how.frame)
            if tag in tags:
                raise InvalidSceneError(
                    f"tag {tag} is on both {tags[tag].obj.name} and {obj.name}: a tag is there once"
                )
            size = _fitting_size(config.template, obj, how.frame, how.tag_size)
            tags[tag] = PlacedTag(tag, size, obj, how.offset.inverse())
    return list(tags.values())


def _fitting_size(template: State, obj: Object, frame: str, size: float | None) -> float:
    if size is None:
        raise InvalidSceneError(f"{obj.name}: frame {frame} needs tag_size, m, of its black square")
    if not (math.isfinite(size) and size >= SMALLEST_TAG):
        raise InvalidSceneError(
            f"{obj.name}: tag_size {size:g} m is not that of a tag: at least {SMALLEST_TAG} m"
        )
    features = {feature.name for feature in obj.type.features}
    if features.issuperset(HALF_SIZES):
        edges = sorted(2.0 * float(template.get(obj, name)) for name in HALF_SIZES)
        if size > SHARE_OF_FACE * edges[1] + 1e-9:  # the largest face is edges[1] by edges[2]
            raise InvalidSceneError(
                f"{obj.name}: a tag of {size:g} m with its white margin does not fit on a face of "
                f"{edges[2]:g} m by {edges[1]:g} m; at most {SHARE_OF_FACE * edges[1]:.4f} m do"
            )
    return size


def tagged_scene(domain: Domain, state: State) -> str:
    """A scene file of a task, with tags on the flat faces of what can move.

    Args:
        domain: Domain with a Panda.
        state: State with the objects; poses of what can move are not written.

    Raises:
        InvalidSceneError: An object has no flat faces, or faces too small for a tag.
    """
    parts, detected = _tagged_parts(domain, state), sampled_scene_config(state).detected
    numbers = iter(range(10**6))
    objects: dict[str, Any] = {}
    for obj in state.objects:
        if obj.type in ROBOTS:
            continue
        entry: dict[str, Any] = {"type": obj.type.name}
        if obj not in detected or opens(obj):
            entry["pose"] = _numbers(pose_of(state, obj))
        if obj in detected:
            entry |= _tag_entry(parts.get(obj.name, ()), obj, numbers)
        objects[obj.name] = {**entry, "features": _features(state, obj)}
    return yaml.safe_dump(
        {"objects": objects}, sort_keys=False, default_flow_style=None, width=1000
    )


def _tagged_parts(domain: Domain, state: State) -> Mapping[str, Sequence[Part]]:
    """The parts of what can move, by name: of a drawer or a lid, those of the part that opens.

    Raises:
        InvalidSceneError: The domain has no bodies around a Panda.
    """
    world = domain.make_world(state)
    if isinstance(world, PandaWorld):
        with world:
            boxes = [body for body in world.scene.free if isinstance(body, Box)]
            return {body.name: (BoxPart(body.half_extents_m),) for body in boxes}
    if isinstance(world, ContactWorld):
        with world:
            free = {body.name: body.parts for body in world.scene.free}
            return free | {body.name: body.moving for body in world.scene.jointed}
    raise InvalidSceneError(f"{domain.name} has no bodies around a Panda, and so no tags on them")


def _tag_entry(parts: Sequence[Part], obj: Object, numbers: Iterator[int]) -> dict[str, Any]:
    """Size and frames of an object's tags, as a scene file has them.

    Raises:
        InvalidSceneError: It has no flat faces, or faces too small for tags.
    """
    if not parts:
        raise InvalidSceneError(f"{obj.name} has no flat faces for tags: it is not a box")
    places = tag_places(parts)
    if not places.poses:
        raise InvalidSceneError(
            f"{obj.name} is too small for tags: its largest would be {1000.0 * places.size:.1f} mm "
            f"on its flat faces, and a camera needs {1000.0 * SMALLEST_PLACED:.0f} mm"
        )
    frames = {tag_frame(next(numbers)): _numbers(pose.inverse()) for pose in places.poses}
    return {"tag_size": round(places.size, DECIMALS), "frames": frames}


def _numbers(pose: Pose) -> list[float]:
    return [round(v, DECIMALS) + 0.0 for v in (*pose.position, *pose.quaternion)]


def _features(state: State, obj: Object) -> dict[str, float]:
    """What a scene file states of an object: all but where it is and how it moves."""
    changing = (*POSE_FEATURES, *VELOCITY_FEATURES, *DRAWER_FEATURES)
    moving = {"held", *(feature.name for feature in changing)}
    names = [feature.name for feature in obj.type.features if feature.name not in moving]
    return {name: round(float(state.get(obj, name)), DECIMALS) for name in names}
