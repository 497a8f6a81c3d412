# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags on the objects of a scene: the scene file that bridge, detector and renderer read.

Every face of an object has a tag, since the hand or another object may hide some. An object is
where any of its tags says; several in one picture count as their mean.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from slap_ros.core import Domain
from slap_ros.errors import InvalidSceneError
from slap_ros.geometry.pose import Pose, Quaternion, Vector, from_yaw, multiply
from slap_ros.relational import Object, State
from slap_ros.robot.scene_config import SceneConfig, sampled_scene_config
from slap_ros.robot.state_assembly import feature_values
from slap_ros.vision.tags import SHARE_OF_FACE, tag_frame, tag_of_frame
from slap_ros.worlds.features import POSE_FEATURES, VELOCITY_FEATURES
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import Box
from slap_ros.worlds.joint_space.world import PandaWorld

SMALLEST_TAG = 0.01  # m; smaller ones are not seen across a table
SIZE_STEP = 0.0005  # m, of which sizes are multiples
DECIMALS = 9  # of numbers in the file
HALF_SIZES = ("half_x", "half_y", "half_z")  # features of a box
UPRIGHT: Quaternion = (0.5, 0.5, 0.5, 0.5)  # of a tag on the face towards x, its y axis upwards
UPSIDE_DOWN: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PlacedTag:
    """A tag on an object.

    Args:
        tag: Number of the tag.
        size: Edge of its black square, m.
        obj: Object that it is on.
        pose: Pose of the tag in the object's frame.
    """

    tag: int
    size: float
    obj: Object
    pose: Pose


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
    """A scene file of a task, with a tag on each face of what can move.

    Args:
        domain: Domain with a Panda.
        state: State with the objects; poses of what can move are not written.

    Raises:
        InvalidSceneError: An object has no flat faces, or faces too small for a tag.
    """
    boxes = _boxes(domain, state)
    detected = sampled_scene_config(state).detected
    numbers = iter(range(10**6))
    objects: dict[str, Any] = {}
    for obj in state.objects:
        if obj.type == ROBOT:
            continue
        where = (
            _tag_entry(boxes, obj, numbers)
            if obj in detected
            else {"pose": [round(v, DECIMALS) for v in feature_values(state, obj, POSE_FEATURES)]}
        )
        objects[obj.name] = {"type": obj.type.name, **where, "features": _features(state, obj)}
    return yaml.safe_dump(
        {"objects": objects}, sort_keys=False, default_flow_style=None, width=1000
    )


def _boxes(domain: Domain, state: State) -> Mapping[str, Box]:
    world = domain.make_world(state)
    if not isinstance(world, PandaWorld):
        raise InvalidSceneError(
            f"{domain.name} has no boxes around a Panda, and so no tags on their faces; the scene "
            "file of a domain at a bench is written by hand"
        )
    with world:
        return {body.name: body for body in world.scene.free if isinstance(body, Box)}


def _tag_entry(boxes: Mapping[str, Box], obj: Object, numbers: Iterator[int]) -> dict[str, Any]:
    if obj.name not in boxes:
        raise InvalidSceneError(f"{obj.name} has no flat faces for tags: it is not a box")
    half = boxes[obj.name].half_extents_m
    size = SIZE_STEP * math.floor(2.0 * SHARE_OF_FACE * min(half) / SIZE_STEP + 1e-6)
    if size < SMALLEST_TAG:
        raise InvalidSceneError(
            f"{obj.name} is too small for tags: its largest would be {1000.0 * size:.1f} mm"
        )
    frames = {
        tag_frame(next(numbers)): [round(v, DECIMALS) + 0.0 for v in (*p.position, *p.quaternion)]
        for p in (face.inverse() for face in face_poses(half))
    }
    return {"tag_size": round(size, DECIMALS), "frames": frames}


def face_poses(half: Vector) -> tuple[Pose, ...]:
    """The poses of tags in the middle of a box's faces: top, +x, +y, -x, -y, bottom.

    Args:
        half: Half the edges of the box, m.
    """
    x, y, z = half
    sides = ((x, 0.0, 0.0), (0.0, y, 0.0), (-x, 0.0, 0.0), (0.0, -y, 0.0))
    return (
        Pose((0.0, 0.0, z)),
        *(
            Pose(middle, multiply(from_yaw(0.5 * math.pi * quarter), UPRIGHT))
            for quarter, middle in enumerate(sides)
        ),
        Pose((0.0, 0.0, -z), UPSIDE_DOWN),
    )


def _features(state: State, obj: Object) -> dict[str, float]:
    """What a scene file states of an object: all but where it is and how it moves."""
    moving = {"held", *(f.name for f in (*POSE_FEATURES, *VELOCITY_FEATURES))}
    names = [feature.name for feature in obj.type.features if feature.name not in moving]
    return {name: round(float(state.get(obj, name)), DECIMALS) for name in names}
