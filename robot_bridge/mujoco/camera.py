# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera over the robot in MuJoCo: pictures of what is there, a little after they are taken."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.camera_parameters import OPTICAL_FRAME
from ensemble.camera_topics import CAMERA_INFO, COMPRESSED_PICTURES, PICTURES
from ensemble.interfaces import TF_STATIC
from ensemble.robot_parameters import MujocoRobotParameters, base_frame
from ensemble.steady_time import create_timer
from robot_bridge.transforms import transform
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import State
from slap_ros.robot.mujoco.camera import tagged_plant
from slap_ros.robot.mujoco.impedance import arm_control
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.mujoco.rendering_process import Picture, RenderingProcess, Shot
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import placed_tags
from slap_ros.vision.image_encoding import RGB8

LOOK = 0.01  # s, between two looks at whether a picture is rendered


def plant_with_camera(
    domain: Domain, initial: State, settings: MujocoRobotParameters
) -> tuple[MujocoPlant, Any]:
    """A plant whose objects have the tags of a scene file, and its model with a camera.

    Args:
        domain: Domain of the state.
        initial: State to begin in.
        settings: Scene file and camera.

    Raises:
        InvalidParameterError: There is no scene file.
        InvalidSceneError: The scene file is malformed, or its tags or objects are not the task's.
    """
    if not settings.scene:
        raise InvalidParameterError(
            "a camera needs a scene file, which says where tags are: slap scene "
            f"{domain.name} --seed {settings.seed} --tags FOLDER, then --scene FOLDER/scene.yaml"
        )
    tags = placed_tags(read_scene_config(Path(settings.scene), domain))
    control = arm_control(settings.impedance, settings.stiffness, settings.lag)
    return tagged_plant(domain, initial, tags, settings.pinhole, settings.optical_pose, control)


class CameraPublisher:
    """Publishes pictures, the camera's intrinsics, and where it is.

    Another process renders, from a copy of the positions: physics goes on meanwhile.
    """

    def __init__(
        self, node: Node, plant: MujocoPlant, model: Any, settings: MujocoRobotParameters
    ) -> None:
        """Begin to take pictures.

        Args:
            node: Publishes.
            plant: What is seen.
            model: Compiled ``mujoco.MjModel`` of the plant, with a camera and tags.
            settings: Camera, noise and rate.

        Raises:
            InvalidParameterError: There is no OpenGL; says what to install.
        """
        self._node, self._plant, self._camera = node, plant, settings.pinhole
        self._renderer = RenderingProcess(model, settings.picture_noise, settings.noise_seed)
        self._header = Header()  # of the picture that is being taken
        self._pictures = node.create_publisher(PICTURES.type, PICTURES.name, PICTURES.qos)
        self._compressed = node.create_publisher(
            COMPRESSED_PICTURES.type, COMPRESSED_PICTURES.name, COMPRESSED_PICTURES.qos
        )
        self._infos = node.create_publisher(CAMERA_INFO.type, CAMERA_INFO.name, CAMERA_INFO.qos)
        self._publish_pose(settings)
        create_timer(node, 1.0 / settings.camera_rate, self._take)
        create_timer(node, LOOK, self._deliver)

    def close(self) -> None:
        """End the picture that is being taken, and the process."""
        self._renderer.close()

    def _publish_pose(self, settings: MujocoRobotParameters) -> None:
        frames = self._node.create_publisher(TF_STATIC.type, TF_STATIC.name, TF_STATIC.qos)
        item = transform(settings.optical_pose, OPTICAL_FRAME)
        stamp = self._node.get_clock().now().to_msg()
        item.header = Header(stamp=stamp, frame_id=base_frame(settings.arm))
        frames.publish(TFMessage(transforms=[item]))

    def _take(self) -> None:
        """Take a picture of now, unless the last one is still being taken."""
        if self._renderer.busy:
            return
        stamp = self._node.get_clock().now().to_msg()
        self._header = Header(stamp=stamp, frame_id=OPTICAL_FRAME)
        wanted = self._compressed.get_subscription_count() > 0
        self._renderer.take(self._plant.positions, wanted)

    def _deliver(self) -> None:
        """Publish the picture that is done, from the node's thread."""
        if self._renderer.ready:
            shot = self._renderer.receive()
            if shot is not None:
                self._publish(self._header, shot)

    def _publish(self, header: Header, shot: Shot) -> None:
        self._infos.publish(self._info(header))
        if shot.jpeg:
            self._compressed.publish(CompressedImage(header=header, format="jpeg", data=shot.jpeg))
        self._pictures.publish(_image(header, shot.picture))

    def _info(self, header: Header) -> CameraInfo:
        camera = self._camera
        matrix = [float(value) for value in camera.matrix.ravel()]
        projection = [*matrix[:3], 0.0, *matrix[3:6], 0.0, *matrix[6:], 0.0]
        return CameraInfo(
            header=header,
            height=camera.height,
            width=camera.width,
            distortion_model="plumb_bob",
            d=[0.0] * 5,
            k=matrix,
            r=[float(value) for value in np.eye(3).ravel()],
            p=projection,
        )


def _image(header: Header, picture: Picture) -> Image:
    height, width, channels = picture.shape
    return Image(
        header=header,
        height=height,
        width=width,
        encoding=RGB8,
        is_bigendian=0,
        step=width * channels,
        data=picture.tobytes(),
    )
