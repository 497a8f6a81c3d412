# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures as ROS messages have them, into grey values and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidMeasurementError
from slap_ros.vision.installed import camera_library
from slap_ros.vision.pinhole_camera import LARGEST_EDGE

RGB8 = "rgb8"
CHANNELS = {"mono8": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}  # by encoding
# What turns an encoding into grey: the name of OpenCV's conversion.
CONVERSIONS = {
    "rgb8": "COLOR_RGB2GRAY",
    "bgr8": "COLOR_BGR2GRAY",
    "rgba8": "COLOR_RGBA2GRAY",
    "bgra8": "COLOR_BGRA2GRAY",
}
QUALITY = 95  # of JPEG, %


def grey_values(encoding: str, height: int, width: int, step: int, data: Any) -> NDArray[np.uint8]:
    """The grey values of a picture.

    Args:
        encoding: Encoding, such as ``rgb8``.
        height: Number of rows.
        width: Number of pixels in a row.
        step: Bytes from one row to the next.
        data: Bytes of all rows.

    Returns:
        Values from 0 to 255, height × width.

    Raises:
        InvalidMeasurementError: The encoding is another one, or sizes do not fit together.
    """
    channels = CHANNELS.get(encoding)
    if channels is None:
        raise InvalidMeasurementError(
            f"a picture in {encoding[:40]!r}; a camera must send one of {', '.join(CHANNELS)}"
        )
    flat = np.frombuffer(data, np.uint8)
    fits = 0 < width <= LARGEST_EDGE and 0 < height <= LARGEST_EDGE and step >= width * channels
    if not fits or flat.size != height * step:
        raise InvalidMeasurementError(
            f"a picture of {width}x{height} in {encoding} with rows of {step} bytes has "
            f"{flat.size} bytes"
        )
    rows = flat.reshape(height, step)[:, : width * channels]
    if channels == 1:
        return np.ascontiguousarray(rows)
    cv2 = camera_library("cv2")
    pixels = np.ascontiguousarray(rows.reshape(height, width, channels))
    grey: NDArray[np.uint8] = cv2.cvtColor(pixels, getattr(cv2, CONVERSIONS[encoding]))
    return grey


def compressed(picture: NDArray[np.uint8]) -> bytes:
    """A picture as JPEG.

    Args:
        picture: Red, green and blue, height × width × 3.
    """
    cv2 = camera_library("cv2")
    _, content = cv2.imencode(".jpg", picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return bytes(content.tobytes())


def decompressed(content: Any) -> NDArray[np.uint8]:
    """The grey values of a picture in JPEG or PNG.

    Args:
        content: Bytes of the compressed picture.

    Raises:
        InvalidMeasurementError: It is no picture.
    """
    cv2 = camera_library("cv2")
    flat = np.frombuffer(content, np.uint8)
    grey = cv2.imdecode(flat, cv2.IMREAD_GRAYSCALE) if flat.size else None
    if grey is None or max(grey.shape) > LARGEST_EDGE:
        raise InvalidMeasurementError("a compressed picture cannot be decoded")
    found: NDArray[np.uint8] = grey
    return found
