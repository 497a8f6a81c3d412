# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""AprilTags of the family 36h11: their names, their look, and what they stand on.

A tag is 8 × 8 cells, its outer ones black. Its size is the edge of that black square. Around it is
a white margin of one cell, without which it is not found. Its frame is that of ``apriltag_ros``:
origin in the middle, x to the right, y upwards, z out of the tag.
"""

from __future__ import annotations

import re
from typing import Any

from slap_ros.errors import InvalidSceneError
from slap_ros.vision.installed import camera_library

FAMILY = "36h11"
NUMBER_OF_TAGS = 587  # in the family
CELLS = 8  # along the black square's edge
MARGIN = 1  # cells, white, on each side
SHARE_OF_FACE = CELLS / (CELLS + 2 * MARGIN)  # of a face's edge: the largest tag on it

SEARCHED = "searched_picture"  # frame whose stamps are those of pictures that were searched

FRAME = re.compile(r"tag([0-9A-Za-z]+h[0-9]+):([0-9]{1,6})", re.ASCII)


def tag_frame(tag: int) -> str:
    """The name of a tag's frame, as ``apriltag_ros`` gives it."""
    return f"tag{FAMILY}:{tag}"


def tag_of_frame(frame: str) -> int:
    """The number of the tag whose frame has a name.

    Raises:
        InvalidSceneError: It is no tag's, another family's, or beyond the family's last.
    """
    found = FRAME.fullmatch(frame)
    if found is None:
        raise InvalidSceneError(f"frame {frame} is not a tag's, such as {tag_frame(1)}")
    if found[1] != FAMILY:
        raise InvalidSceneError(
            f"frame {frame} is of the family {found[1]}; tags are of the family {FAMILY}"
        )
    if int(found[2]) >= NUMBER_OF_TAGS:
        raise InvalidSceneError(
            f"frame {frame}: the family {FAMILY} has tags 0 to {NUMBER_OF_TAGS - 1}"
        )
    return int(found[2])


def tag_image(tag: int, cell: int) -> Any:
    """A tag with its white margin.

    Args:
        tag: Number of the tag.
        cell: Pixels of a cell's edge.

    Returns:
        Grey values, (10 · cell) × (10 · cell), uint8.
    """
    cv2 = camera_library("cv2")
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    upside_down = cv2.aruco.generateImageMarker(family, tag, CELLS * cell, borderBits=1)
    inner, edge = cv2.rotate(upside_down, cv2.ROTATE_180), MARGIN * cell  # as AprilTag has it
    return cv2.copyMakeBorder(inner, edge, edge, edge, edge, cv2.BORDER_CONSTANT, value=255)
