# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a real camera adds to a picture: blur, noise, lost frames; a function of a seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidParameterError
from slap_ros.vision.installed import camera_library

LARGEST_BLUR = 20.0  # pixels


@dataclass(frozen=True)
class ImageNoise:
    """How bad pictures are.

    Args:
        grey_levels: Standard deviation of each value, of 255.
        blur: Standard deviation of the blur, pixels.
        lost: Share of frames that are lost.

    Raises:
        InvalidParameterError: Negative, or every frame lost.
    """

    grey_levels: float = 2.0
    blur: float = 0.0
    lost: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.grey_levels) and self.grey_levels >= 0.0):
            raise InvalidParameterError(f"noise is at least 0 grey levels, not {self.grey_levels}")
        if not 0.0 <= self.blur <= LARGEST_BLUR:
            raise InvalidParameterError(f"blur is 0 to {LARGEST_BLUR} pixels, not {self.blur}")
        if not 0.0 <= self.lost < 1.0:
            raise InvalidParameterError(f"lost frames are a share in [0, 1), not {self.lost}")

    def taken(
        self, picture: NDArray[np.uint8], rng: np.random.Generator
    ) -> NDArray[np.uint8] | None:
        """A picture as the camera gives it.

        Args:
            picture: Values without noise.
            rng: Source of the noise.

        Returns:
            The values with blur and noise; None where the frame is lost.
        """
        if rng.random() < self.lost:
            return None
        values: NDArray[np.float32] = picture.astype(np.float32)
        if self.blur > 0.0:
            values = camera_library("cv2").GaussianBlur(values, (0, 0), self.blur)
        if self.grey_levels > 0.0:
            values += self.grey_levels * rng.standard_normal(values.shape, dtype=np.float32)
        return np.clip(np.rint(values), 0, 255).astype(np.uint8)
