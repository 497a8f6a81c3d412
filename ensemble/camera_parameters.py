# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of a camera that is simulated, and of what finds tags in pictures."""

from __future__ import annotations

from dataclasses import dataclass

from ensemble.parameters import parameter
from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.vision.image_noise import ImageNoise
from slap_ros.vision.pinhole_camera import LARGEST_EDGE, PinholeCamera, looking_at

OPTICAL_FRAME = "camera_optical_frame"
EYE = (1.05, -0.45, 0.75)  # m, from the base: across the table, above the blocks
TARGET = (0.5, -0.02, 0.15)  # m


@dataclass(frozen=True)
class CameraParameters:
    """What a simulated camera is: see the docstring of ``robot_bridge.mujoco.node``."""

    camera: bool = parameter(False, "whether a camera with tags takes the place of exact frames")
    scene: str = parameter("", "scene file with the tags, for the camera")
    camera_eye: tuple[float, ...] = parameter(EYE, "m, where the camera is", low=-10.0)
    camera_target: tuple[float, ...] = parameter(TARGET, "m, what it looks at", low=-10.0)
    camera_width: int = parameter(1280, "pixels", low=16, high=LARGEST_EDGE)
    camera_height: int = parameter(720, "pixels", low=16, high=LARGEST_EDGE)
    camera_focal: float = parameter(1200.0, "pixels", low=16.0, high=1e5)
    camera_rate: float = parameter(5.0, "Hz, at most: software renders about three", low=0.1)
    image_noise: float = parameter(2.0, "grey levels of 255, standard deviation")
    image_blur: float = parameter(0.0, "pixels, standard deviation")
    image_loss: float = parameter(0.0, "share of pictures that are lost")

    @property
    def pinhole(self) -> PinholeCamera:
        """The intrinsics of the camera."""
        return PinholeCamera.centred(self.camera_width, self.camera_height, self.camera_focal)

    @property
    def optical_pose(self) -> Pose:
        """The pose of its optical frame in the robot's base.

        Raises:
            InvalidParameterError: It is not stated by three numbers each, or looks straight down.
        """
        if len(self.camera_eye) != 3 or len(self.camera_target) != 3:
            raise InvalidParameterError("parameters camera_eye and camera_target are x y z, in m")
        (x, y, z), (to_x, to_y, to_z) = self.camera_eye, self.camera_target
        return looking_at((x, y, z), (to_x, to_y, to_z))

    @property
    def picture_noise(self) -> ImageNoise:
        """How bad its pictures are.

        Raises:
            InvalidParameterError: Negative, or every picture lost.
        """
        return ImageNoise(self.image_noise, self.image_blur, self.image_loss)


@dataclass(frozen=True)
class TagDetectorParameters:
    """What the tag detector looks for: see the docstring of ``robot_bridge.tag_detector.node``."""

    domain: str = parameter("obstacle_tower", "which domain")
    preset: str = parameter("", "as the bridge's")
    skills: str = parameter("", "as the bridge's")
    scene: str = parameter("", "scene file with the tags; needed")
    image: str = parameter("camera/image_rect", "topic of rectified pictures")
    camera_info: str = parameter("camera/camera_info", "topic of the camera's intrinsics")
    compressed: bool = parameter(False, "whether to take IMAGE/compressed instead of IMAGE")

    @property
    def choice(self) -> DomainChoice:
        """The domain whose objects the scene file has.

        Raises:
            InvalidParameterError: Skills that are not known.
        """
        return DomainChoice(self.domain, self.preset, self.skills)
