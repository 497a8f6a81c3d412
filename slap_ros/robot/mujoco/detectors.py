# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What tells where the objects of a plant are: exact poses, or a camera and tags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from slap_ros.core import Domain
from slap_ros.files import parse_yaml
from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.relational import State
from slap_ros.robot.mujoco.arm import JOINT_POSITIONS, ArmControl
from slap_ros.robot.mujoco.camera import MujocoCamera, tagged_plant
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.scene_config import DETECTED, SceneConfig, sampled_scene_config, scene_config
from slap_ros.robot.tagged_scene import placed_tags, tagged_scene
from slap_ros.vision.image_encoding import RGB8, grey_values
from slap_ros.vision.image_noise import ImageNoise
from slap_ros.vision.pinhole_camera import PinholeCamera, looking_at
from slap_ros.vision.tag_detection import TagDetector
from slap_ros.vision.tags import tag_frame

UNMOVED = 4e-4  # m and rad: less than the error of a detection, so that a new picture says no more
PICTURE_S = 0.2  # s, between two pictures


class DetectedPose(NamedTuple):
    """An object's frame as a detector publishes it."""

    frame: str  # name of the frame
    base: Pose  # of the parent frame, in the robot's base
    seen: Pose  # of the frame in its parent


class ObjectDetector(Protocol):
    """Detects the objects of a plant of its own."""

    plant: MujocoPlant
    config: SceneConfig  # how they are detected
    period_s: float  # time between two detections

    def detect(self) -> Sequence[DetectedPose] | None:
        """Find the frames that show objects at this moment; None where nothing was looked at."""
        ...

    def close(self) -> None:
        """Release what it uses."""
        ...


class ExactDetector:
    """Knows where every object is.

    Args:
        domain: Domain with a Panda.
        initial: State of a task, in which the plant begins.
    """

    period_s = 1.0 / 30.0

    def __init__(self, domain: Domain, initial: State) -> None:
        self.plant = MujocoPlant.of(domain, initial)
        self.config = sampled_scene_config(initial)

    def detect(self) -> Sequence[DetectedPose]:
        """Each object in a frame of its own, in the robot's base."""
        poses = self.plant.poses()
        return [DetectedPose(f"{DETECTED}{name}", IDENTITY, pose) for name, pose in poses.items()]

    def close(self) -> None:
        """Release nothing: exact poses need no camera."""


@dataclass(frozen=True)
class CameraSettings:
    """A camera beside the robot.

    Args:
        camera: Intrinsics of the camera.
        pose: Pose of its optical frame in the robot's base.
        noise: Noise of the pictures.
        seed: Seed of the noise.
    """

    camera: PinholeCamera
    pose: Pose
    noise: ImageNoise = field(default_factory=lambda: ImageNoise(2.0))
    seed: int = 0


def camera_beside() -> CameraSettings:
    """The camera of the nodes, across the table and above the blocks, with half of its pixels."""
    eye, target = (1.05, -0.45, 0.75), (0.5, -0.02, 0.15)
    return CameraSettings(PinholeCamera.centred(960, 540, 900.0), looking_at(eye, target))


class TagCameraDetector:
    """Finds the tags of objects in rendered pictures; knows nothing else of where they are.

    While nothing moves, the picture that was searched counts again: searching takes a second.

    Args:
        domain: Domain with a Panda, whose objects have flat faces.
        initial: State of a task, in which the plant begins.
        settings: Camera, and where it is.
        control: How the arm goes to joint positions.

    Raises:
        InvalidSceneError: An object has no room for tags.
        InvalidParameterError: There is no OpenGL, or a library is not installed.
    """

    def __init__(
        self,
        domain: Domain,
        initial: State,
        settings: CameraSettings,
        control: ArmControl = JOINT_POSITIONS,
    ) -> None:
        text = tagged_scene(domain, initial)
        self.config = scene_config(parse_yaml(text), "of the task", domain)
        self.period_s, self._settings = PICTURE_S, settings
        tags = placed_tags(self.config)
        self.plant, model = tagged_plant(
            domain, initial, tags, settings.camera, settings.pose, control
        )
        self._camera = MujocoCamera(model)
        self._library = TagDetector({tag.tag: tag.size for tag in tags})
        self._rng = np.random.default_rng(settings.seed)
        self._pictured: np.ndarray | None = None
        self._found: Sequence[DetectedPose] | None = None

    def detect(self) -> Sequence[DetectedPose] | None:
        """The tags in a picture of now; None where the picture is lost."""
        now, before = self.plant.positions, self._pictured
        if self._found is None or before is None or np.abs(now - before).max() > UNMOVED:
            self._pictured, self._found = now, self._search(now)
        return self._found

    def _search(self, positions: np.ndarray) -> Sequence[DetectedPose] | None:
        settings = self._settings
        picture = settings.noise.taken(self._camera.picture(positions), self._rng)
        if picture is None:  # lost
            return None
        height, width, channels = picture.shape
        grey = grey_values(RGB8, height, width, width * channels, picture.tobytes())
        found = self._library.detect(grey, settings.camera)
        return [DetectedPose(tag_frame(tag.tag), settings.pose, tag.pose) for tag in found]

    def close(self) -> None:
        """Release what OpenGL holds."""
        self._camera.close()
