# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera without distortion: from points to pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose, Vector, normalised

LARGEST_EDGE = 8192  # pixels


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics of a camera; the middle of the first pixel is at (0, 0), as in ROS and OpenCV.

    Args:
        width: Width of a picture, pixels.
        height: Height of a picture, pixels.
        fx: Focal length along the rows, pixels.
        fy: Focal length along the columns, pixels.
        cx: Where the optical axis meets the picture, along the rows, pixels.
        cy: Where the optical axis meets the picture, along the columns, pixels.

    Raises:
        InvalidParameterError: A size or a focal length that no camera has.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if not (0 < self.width <= LARGEST_EDGE and 0 < self.height <= LARGEST_EDGE):
            raise InvalidParameterError(
                f"a picture has up to {LARGEST_EDGE} pixels an edge, not {self.width}x{self.height}"
            )
        finite = all(map(math.isfinite, (self.fx, self.fy, self.cx, self.cy)))
        if not (finite and self.fx > 0.0 and self.fy > 0.0):
            raise InvalidParameterError(
                f"a camera with focal lengths {self.fx:g}, {self.fy:g} pixels and its axis at "
                f"({self.cx:g}, {self.cy:g}) is not calibrated"
            )

    @classmethod
    def centred(cls, width: int, height: int, focal: float) -> PinholeCamera:
        """A camera with square pixels whose axis meets the middle of the picture.

        Args:
            width: Width of a picture, pixels.
            height: Height of a picture, pixels.
            focal: Focal length, pixels.
        """
        return cls(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The camera matrix, row by row: ``K`` of CameraInfo."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


def looking_at(eye: Vector, target: Vector) -> Pose:
    """The pose of an optical frame (x right, y down, z ahead) that looks at a point, upright.

    Args:
        eye: Where the camera is, m.
        target: Point in the middle of its picture, m.

    Raises:
        InvalidParameterError: It looks straight up or down, or nowhere.
    """
    ahead = np.subtract(target, eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    if float(np.linalg.norm(right)) < 1e-9:
        raise InvalidParameterError(f"no upright camera at {eye} looks at {target}")
    z = ahead / np.linalg.norm(ahead)
    x = right / np.linalg.norm(right)
    return Pose(eye, quaternion_of(np.column_stack([x, np.cross(z, x), z])))


def quaternion_of(matrix: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """The quaternion x y z w of a rotation matrix."""
    m = matrix
    # The largest of the four candidates: no division by what is almost zero.
    candidates = (
        (1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]),
        (m[0, 1] + m[1, 0], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]),
        (m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 - m[0, 0] - m[1, 1] + m[2, 2], m[1, 0] - m[0, 1]),
        (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + m[0, 0] + m[1, 1] + m[2, 2]),
    )
    x, y, z, w = map(float, max(candidates, key=lambda q: sum(float(part) ** 2 for part in q)))
    return normalised((x, y, z, w))
