# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations of many vectors at once, by quaternions (x, y, z, w) of length 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rotate_each(turns: Array, vectors: Array) -> Array:
    """Vectors as they are after turns, coordinates last.

    Args:
        turns: Quaternions, shape (..., 4).
        vectors: Vectors, shape (..., 3).

    Returns:
        Shape (..., 3).
    """
    axis, cosine = turns[..., :3], turns[..., 3:]
    around = 2.0 * np.cross(axis, vectors)
    turned: Array = vectors + cosine * around + np.cross(axis, around)
    return turned


def inverse_each(turns: Array) -> Array:
    """The opposite turns, shape (..., 4)."""
    opposite: Array = turns * np.array([-1.0, -1.0, -1.0, 1.0])
    return opposite


def x_axes(turns: Array) -> Array:
    """Where turns take the x axis, shape (..., 3)."""
    x, y, z, w = np.moveaxis(turns, -1, 0)
    return np.stack(
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)], axis=-1
    )
