# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics of a camera, as its driver and image_proc name them; not recorded, for they are large.

Only what has a camera imports them: a ROS 2 without pictures' messages runs all the rest.
"""

from __future__ import annotations

from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from ensemble.interfaces import Topic, qos_profile
from slap_ros.messages import qos

PROFILE = qos_profile(qos.PICTURES)
PICTURES = Topic("camera/image_rect", Image, PROFILE)
COMPRESSED_PICTURES = Topic("camera/image_rect/compressed", CompressedImage, PROFILE)
CAMERA_INFO = Topic("camera/camera_info", CameraInfo, PROFILE)
