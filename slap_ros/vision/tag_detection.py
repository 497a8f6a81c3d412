# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tags in a picture, and where they are.

Corners are found by the AprilTag library, which fits lines to a tag's edges. On rendered pictures
its corners are more than twice as exact as those of OpenCV's ArUco module
(``benchmarks.detections``). Poses are what minimises the error in the picture, from both of the
two starts that a square has (Collins and Bartoli 2014).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.pose import Pose
from slap_ros.vision.installed import camera_library
from slap_ros.vision.pinhole_camera import PinholeCamera, quaternion_of
from slap_ros.vision.tags import FAMILY

MARGIN = 20.0  # of the library's decision; what is below is no tag
WRONG_BITS = 0  # that are corrected at most: of 587 tags, corrected ones are seen in anything
HALF_PIXEL = 0.5  # the library's first pixel begins at (0, 0), and ours has its middle there

# Corners in halves of the size, in the order in which the library has them.
CORNERS = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])


@dataclass(frozen=True)
class TagDetection:
    """A tag that was found.

    Args:
        tag: Number of the tag.
        corners: Corners of the tag in the picture, 4 × 2, pixels.
        pose: Pose of the tag in the camera's optical frame.
    """

    tag: int
    corners: NDArray[np.float64]
    pose: Pose


class TagDetector:
    """Finds tags whose sizes are known; others are ignored.

    Args:
        sizes: Edge of the black square of each tag, m, by the tag's number.

    Raises:
        InvalidParameterError: The libraries are not installed.
    """

    def __init__(self, sizes: Mapping[int, float]) -> None:
        self._sizes = dict(sizes)
        self._library = _apriltag_library()

    def detect(self, grey: NDArray[np.uint8], camera: PinholeCamera) -> list[TagDetection]:
        """Find tags in a picture.

        Args:
            grey: Grey values, height × width.
            camera: Camera that took it.

        Returns:
            The tags that were found, by their number.
        """
        found = {}
        for item in self._library.detect(np.ascontiguousarray(grey)):
            unsure = item.decision_margin < MARGIN or item.hamming > WRONG_BITS
            if unsure or item.tag_id not in self._sizes:
                continue
            corners = np.asarray(item.corners, dtype=np.float64) - HALF_PIXEL
            pose = tag_pose(corners, camera, self._sizes[item.tag_id])
            found[item.tag_id] = TagDetection(item.tag_id, corners, pose)
        return [found[tag] for tag in sorted(found)]


def _apriltag_library() -> Any:
    """A detector of the AprilTag library, at full resolution.

    It is never destroyed: the bindings free the family before the detector that still refers to it,
    which now and then ends the process by a segmentation fault.
    """
    library = camera_library("pupil_apriltags")
    kept = type("KeptDetector", (library.Detector,), {"__del__": lambda _: None})
    return kept(families=f"tag{FAMILY}", nthreads=1, quad_decimate=1.0, refine_edges=1)


def tag_pose(corners: NDArray[np.float64], camera: PinholeCamera, size: float) -> Pose:
    """Where a tag is.

    Args:
        corners: Corners of the tag in the picture, 4 × 2, pixels, in the order of ``CORNERS``.
        camera: Camera that took the picture.
        size: Edge of the black square, m.

    Returns:
        The pose of the tag in the camera's optical frame (x right, y down, z ahead).
    """
    cv2 = camera_library("cv2")
    points, matrix = 0.5 * size * CORNERS, camera.matrix
    _, turns, positions, errors = cv2.solvePnPGeneric(
        points[::-1].copy(), corners[::-1].copy(), matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    best = int(np.argmin(np.ravel(errors)))
    turn, position = cv2.solvePnPRefineLM(
        points, corners, matrix, None, turns[best], positions[best]
    )
    x, y, z = (float(part) for part in np.ravel(position))
    return Pose((x, y, z), quaternion_of(cv2.Rodrigues(turn)[0]))
