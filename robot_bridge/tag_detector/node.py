# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds AprilTags in pictures and publishes where they are, as apriltag_ros does.

It looks for the tags of a scene file, the one that the bridge has. Pictures are to be rectified:
distortion is not corrected. While a picture is searched, newer ones wait, and only the newest is
kept.

ROS Parameters:
    domain (string, "obstacle_tower"), preset (string, ""), skills (string, ""): whose objects the
        scene file has.
    scene (string, ""): scene file with the tags; needed.
    image (string, "camera/image_rect"), camera_info (string, "camera/camera_info"): topics.
    compressed (bool, false): whether to take IMAGE/compressed instead of IMAGE.

Subscribers:
    IMAGE (sensor_msgs/Image): mono8, rgb8, bgr8, rgba8 or bgra8; or
    IMAGE/compressed (sensor_msgs/CompressedImage): JPEG or PNG.
    CAMERA_INFO (sensor_msgs/CameraInfo): K is used.

Publishers:
    tf (tf2_msgs/TFMessage): tags, as frames tag36h11:ID, each a child of the picture's frame. x is
        to the right, y upwards, z out of the tag. Stamps are the picture's. The frame
        searched_picture comes with each picture, also with one that shows no tag.
    diagnostics (diagnostic_msgs/DiagnosticArray): pictures, tags found, what was refused; 1 Hz.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future as Job
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.camera_parameters import TagDetectorParameters
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.interfaces import NEWEST_PICTURE, TF
from ensemble.parameters import read_parameters
from ensemble.steady_time import create_timer
from robot_bridge.transforms import transform
from slap_ros.errors import InvalidMeasurementError, InvalidParameterError
from slap_ros.geometry.pose import IDENTITY
from slap_ros.robot.scene_config import read_scene_config
from slap_ros.robot.tagged_scene import placed_tags
from slap_ros.skills.domain_choice import open_domain
from slap_ros.vision.image_encoding import decompressed, grey_values
from slap_ros.vision.pinhole_camera import PinholeCamera
from slap_ros.vision.tag_detection import TagDetection, TagDetector
from slap_ros.vision.tags import SEARCHED, tag_frame

LOOK = 0.01  # s, between two looks at whether a picture is searched
QUIET = 10.0  # s between two log lines about pictures that cannot be used
Grey = NDArray[np.uint8]


class TagDetectorNode(Node):
    """The tag detector."""

    def __init__(self, **kwargs: Any) -> None:
        """Subscribe to a camera.

        Args:
            kwargs: The node's.

        Raises:
            InvalidParameterError: There is no scene file, or the libraries are not installed.
            InvalidSceneError: The scene file is malformed, or its tags are.
        """
        super().__init__("tag_detector", **kwargs)
        settings = read_parameters(self, TagDetectorParameters)
        if not settings.scene:
            raise InvalidParameterError("parameter scene is needed: a scene file with tags")
        config = read_scene_config(Path(settings.scene), open_domain(settings.choice))
        self._detector = TagDetector({tag.tag: tag.size for tag in placed_tags(config)})
        self._camera: PinholeCamera | None = None
        self._counts = Counter(pictures=0, tags=0, refused=0)
        self._workers = ThreadPoolExecutor(1)
        self._search: tuple[Header, Job[list[TagDetection]]] | None = None
        self._waiting: tuple[Header, Callable[[], Grey]] | None = None
        self._frames = self.create_publisher(TF.type, TF.name, TF.qos)
        self._subscribe(settings)
        create_timer(self, LOOK, self._go_on)
        DiagnosticsPublisher(self, lambda: self._counts)

    def _subscribe(self, settings: TagDetectorParameters) -> None:
        quality = NEWEST_PICTURE
        self.create_subscription(CameraInfo, settings.camera_info, self._on_info, quality)
        if settings.compressed:
            topic = f"{settings.image}/compressed"
            self.create_subscription(CompressedImage, topic, self._on_compressed, quality)
        else:
            self.create_subscription(Image, settings.image, self._on_image, quality)

    def destroy_node(self) -> None:
        """Wait for the picture that is searched as well."""
        self._workers.shutdown()
        super().destroy_node()

    def _on_info(self, message: CameraInfo) -> None:
        k = message.k
        try:
            self._camera = PinholeCamera(message.width, message.height, k[0], k[4], k[2], k[5])
        except InvalidParameterError as error:
            self._refuse(error)

    def _on_image(self, m: Image) -> None:
        self._take(m.header, lambda: grey_values(m.encoding, m.height, m.width, m.step, m.data))

    def _on_compressed(self, message: CompressedImage) -> None:
        self._take(message.header, lambda: decompressed(message.data))

    def _take(self, header: Header, decode: Callable[[], Grey]) -> None:
        """Have a picture wait for the one that is being searched; it replaces what waits."""
        self._waiting = (header, decode)

    def _go_on(self) -> None:
        """Publish what was found in a picture, and begin with the next."""
        if self._search is not None and self._search[1].done():
            (header, job), self._search = self._search, None
            self._on_found(header, job)
        if self._search is None and self._waiting is not None and self._camera is not None:
            (header, decode), camera = self._waiting, self._camera
            self._waiting = None
            job = self._workers.submit(lambda: self._found(decode(), camera))
            self._search = header, job

    def _found(self, grey: Grey, camera: PinholeCamera) -> list[TagDetection]:
        """The tags in a picture; runs in the worker's thread."""
        height, width = grey.shape
        if (width, height) != (camera.width, camera.height):
            raise InvalidMeasurementError(
                f"a picture of {width}x{height} from a camera that is calibrated for "
                f"{camera.width}x{camera.height}"
            )
        return self._detector.detect(grey, camera)

    def _on_found(self, header: Header, job: Job[list[TagDetection]]) -> None:
        try:
            tags = job.result()
        except InvalidMeasurementError as error:
            self._refuse(error)
        else:
            self._publish(header, tags)

    def _publish(self, header: Header, tags: list[TagDetection]) -> None:
        self._counts["pictures"] += 1
        self._counts["tags"] += len(tags)
        items = [transform(tag.pose, tag_frame(tag.tag)) for tag in tags]
        items.append(transform(IDENTITY, SEARCHED))
        for item in items:
            item.header = header
        self._frames.publish(TFMessage(transforms=items))

    def _refuse(self, error: Exception) -> None:
        self._counts["refused"] += 1
        self.get_logger().warning(f"refused: {error}", throttle_duration_sec=QUIET)


def main() -> int:
    """Run the node."""
    return run_node("tag_detector", TagDetectorNode)
