# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What there is around a real robot: which objects, detected as which TF frame or standing where.

A scene file is YAML, in the order in which the domain wants its objects (in Obstacle Tower the
first block is the target block)::

    objects:
      block1:
        type: block
        frame: tag36h11:1        # child frame of the detections
        offset: [0, 0, -0.025]   # m, from that frame to the object's middle, in the frame's axes
        features: {mass: 0.5, friction: 0.9, half_x: 0.025, ...}
      block2:                    # with a tag on each face: whichever are seen count
        type: block
        tag_size: 0.04           # m, edge of the black square, for ``tag_detector``
        frames:                  # the object's middle in each frame: m, quaternion x y z w
          tag36h11:2: [0, 0, -0.025, 0, 0, 0, 1]
          tag36h11:3: [0, 0, -0.025, -0.5, -0.5, -0.5, 0.5]
        features: {mass: 0.5, friction: 0.9, half_x: 0.025, ...}
      table:
        type: surface
        pose: [0.5, 0, -0.175, 0, 0, 0, 1]   # m and quaternion x y z w, in the base's frame
        features: {half_x: 0.25, ...}

At a bench, what opens has both: the pose at which it stands, and the frame of the part that opens::

      cabinet0:
        type: cabinet
        pose: [0.47, 0.35, 0, 0, 0, 0.707107, 0.707107]
        frames:  # the frame of that part in the tag's: here upright on the drawer's front
          tag36h11:4: [0, -0.045, 0, 0, 0.707107, 0.707107, 0]
        features: {support_height: 0.04}
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.core import Domain
from slap_ros.errors import InvalidMeasurementError, InvalidSceneError, InvalidStateError
from slap_ros.files import parse_yaml, read_text, reason_of
from slap_ros.geometry.pose import IDENTITY, ORIGIN, Pose
from slap_ros.relational import Object, State
from slap_ros.robot.tracking import measured_pose
from slap_ros.worlds.contact.features import ROBOT as HAND_OF_FORCES
from slap_ros.worlds.contact.features import opening_features
from slap_ros.worlds.contact.features import robot_features as hand_features
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.links import MOVING
from slap_ros.worlds.features import body_features, pose_features
from slap_ros.worlds.joint_space.features import ROBOT, robot_features
from slap_ros.worlds.panda import HOME, grasp_pose

MAX_SCENE_BYTES = 2**20
DETECTED = "detected_"  # prefix of detection frames where no scene file names them
PARKED = 10.0  # m from the base: where what was not yet detected is out of everything's way
KEYS = frozenset({"type", "frame", "offset", "frames", "tag_size", "pose", "features"})
MALFORMED = (
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
    OverflowError,
    InvalidMeasurementError,
)


@dataclass(frozen=True)
class DetectedFrame:
    """How an object is detected."""

    frame: str  # child frame in TF
    # Of the object's middle, or of the frame of its part that opens, in the detected frame.
    offset: Pose = IDENTITY
    tag_size: float | None = None  # m, edge of a tag's black square; None: not said


@dataclass(frozen=True)
class SceneConfig:
    """The objects, what is known of them beforehand, and how the others are detected.

    Args:
        template: A state of the objects; poses of detected ones in it have no meaning.
        detected: The objects that are detected, and the frames of each, no frame twice.

    Raises:
        InvalidSceneError: A frame is stated twice.
    """

    template: State
    detected: Mapping[Object, Sequence[DetectedFrame]]

    def __post_init__(self) -> None:
        whose: dict[str, Object] = {}
        for obj, frames in self.detected.items():
            for how in frames:
                if how.frame in whose:
                    raise InvalidSceneError(
                        f"frame {how.frame} is both {whose[how.frame].name}'s and {obj.name}'s: "
                        "each tag is on one object, once"
                    )
                whose[how.frame] = obj


def sampled_scene_config(initial: State) -> SceneConfig:
    """The scene of a sampled task: what can move is detected, the rest is where the task has it.

    Of a drawer or a lid, the part that opens is detected, in a frame of that part's own name.
    """
    moving = [obj for obj in initial.objects if _has(obj, "held") or opens(obj)]
    return SceneConfig(
        initial, {obj: (DetectedFrame(f"{DETECTED}{moving_name(obj)}"),) for obj in moving}
    )


def opens(obj: Object) -> bool:
    """Whether a part of an object slides or turns, and the rest stands."""
    return _has(obj, "opening")


def moving_name(obj: Object) -> str:
    """The name of what moves of an object: its own, or that of its part that opens."""
    return f"{obj.name}{MOVING}" if opens(obj) else obj.name


def _has(obj: Object, feature: str) -> bool:
    return feature in obj.type.column


def chosen_scene_config(path: str, domain: Domain, sampled: Callable[[], State]) -> SceneConfig:
    """The scene of a scene file; where none is named, that of a sampled task.

    Args:
        path: Path of the scene file; empty: none.
        domain: Domain of the objects.
        sampled: Gives the state of a task, whose objects there are where there is no file.

    Raises:
        InvalidSceneError: The file is missing or malformed, or its objects are not the domain's.
    """
    return read_scene_config(Path(path), domain) if path else sampled_scene_config(sampled())


def read_scene_config(path: Path, domain: Domain) -> SceneConfig:
    """The scene that a scene file describes.

    Raises:
        InvalidSceneError: It is missing or malformed, or its objects are not the domain's.
    """
    try:
        content = parse_yaml(read_text(path, MAX_SCENE_BYTES))
    except (OSError, ValueError) as error:
        raise InvalidSceneError(f"scene file {path} cannot be read: {reason_of(error)}") from error
    return scene_config(content, str(path), domain)


def scene_config(content: object, path: str, domain: Domain) -> SceneConfig:
    """The scene that the content of a scene file describes.

    Args:
        content: What the YAML says.
        path: Name of the file, for messages.
        domain: Domain of the objects.

    Raises:
        InvalidSceneError: It is malformed, or its objects are not the domain's.
    """
    if not isinstance(content, dict) or not isinstance(content.get("objects"), dict):
        raise InvalidSceneError(f"scene file {path} has no mapping `objects`")
    robot, at_home = _robot(domain)
    features: dict[Object, Mapping[str, float]] = {robot: at_home}
    detected: dict[Object, Sequence[DetectedFrame]] = {}
    for name, entry in content["objects"].items():
        parked = Pose((PARKED + len(features), 0.0, 0.0))
        try:
            obj, given, how = _object(str(name), entry, domain, parked)
        except MALFORMED as error:
            raise InvalidSceneError(f"scene file {path}, object {name}: {error}") from error
        features[obj] = given
        if how:
            detected[obj] = how
    try:
        return SceneConfig(State.build(features), detected)
    except (InvalidStateError, InvalidSceneError) as error:
        raise InvalidSceneError(f"scene file {path}: {error}") from error


def _robot(domain: Domain) -> tuple[Object, Mapping[str, float]]:
    """The robot as it is before anything is measured."""
    if HAND_OF_FORCES in domain.types:
        return HAND_OF_FORCES("robot"), hand_features(hand_at(grasp_pose(HOME).position))
    return ROBOT("robot"), robot_features(HOME)


def _object(
    name: str, entry: Mapping[str, Any], domain: Domain, parked: Pose
) -> tuple[Object, Mapping[str, float], Sequence[DetectedFrame]]:
    if unknown := set(entry) - KEYS:
        raise ValueError(f"unknown keys {sorted(unknown)}; there are {sorted(KEYS)}")
    kinds = domain.types_by_name
    if entry.get("type") not in kinds:
        raise ValueError(f"unknown type {entry.get('type')!r}; there are {', '.join(kinds)}")
    given = {str(k): float(v) for k, v in entry.get("features", {}).items()}
    obj = kinds[entry["type"]](name)
    if opens(obj):
        if "pose" not in entry or len(entry.keys() & {"frame", "frames"}) != 1:
            raise ValueError(
                "what opens needs a pose, at which it stands, and either a frame, or several "
                "frames, in which its part that opens is detected"
            )
        shut = {**pose_features(_pose(entry["pose"])), **opening_features(0.0)}
        return obj, {**shut, **given}, _frames(entry)
    if len(entry.keys() & {"frame", "frames", "pose"}) != 1:
        raise ValueError(
            "an object has either a frame, or several frames, in which it is detected, or a pose"
        )
    moves = _has(obj, "held")
    if "pose" not in entry:
        start = body_features(parked.position) if moves else pose_features(parked)
        return obj, {**start, **given}, _frames(entry)
    if moves:
        raise ValueError("what can move needs a frame, in which it is detected")
    return obj, {**pose_features(_pose(entry["pose"])), **given}, ()


def _frames(entry: Mapping[str, Any]) -> Sequence[DetectedFrame]:
    """The frames in which an object is detected: one with an offset, or several with poses."""
    size = float(entry["tag_size"]) if "tag_size" in entry else None
    if "frame" in entry:
        x, y, z = map(float, entry.get("offset", ORIGIN))
        return (DetectedFrame(str(entry["frame"]), Pose((x, y, z)), size),)
    if "offset" in entry:
        raise ValueError("offset belongs to frame; frames have a pose each")
    if not entry["frames"]:
        raise ValueError("frames is empty: in which is the object detected?")
    return tuple(
        DetectedFrame(str(frame), _pose(numbers), size)
        for frame, numbers in entry["frames"].items()
    )


def _pose(numbers: Sequence[Any]) -> Pose:
    values = [float(v) for v in numbers]
    if len(values) != 7:
        raise ValueError("a pose is x y z and a quaternion x y z w")
    return measured_pose(values[:3], values[3:])
