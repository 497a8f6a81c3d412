# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions of :mod:`slap_ros.portable_math` for single numbers, the same to the bit."""

from __future__ import annotations

import math

import numpy as np

from slap_ros.compilation import inner
from slap_ros.portable_math import (
    ATAN_BORDERS,
    ATAN_COEFFICIENTS,
    ATAN_STARTS,
    ATAN_TANGENTS,
    COS_COEFFICIENTS,
    HALF_PI,
    PI,
    QUARTER_HIGH,
    QUARTER_LOW,
    QUARTER_TURNS,
    SIN_COEFFICIENTS,
)


@inner
def sin_cos(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle in rad."""
    quarters = np.rint(angle * QUARTER_TURNS)
    rest = (angle - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW
    square = rest * rest
    sine, cosine = 0.0, 0.0
    for coefficient in SIN_COEFFICIENTS:
        sine = sine * square + coefficient
    for coefficient in COS_COEFFICIENTS:
        cosine = cosine * square + coefficient
    sine = rest + rest * square * sine
    cosine = 1.0 + square * cosine
    quadrant = quarters - 4.0 * math.floor(quarters * 0.25)
    if quadrant == 1.0 or quadrant == 3.0:
        sine, cosine = cosine, sine
    if quadrant >= 2.0:
        sine = -sine
    if quadrant == 1.0 or quadrant == 2.0:
        cosine = -cosine
    return sine, cosine


@inner
def arctan2(y: float, x: float) -> float:
    """The angle of a vector, rad, -pi to pi; 0 for no vector."""
    width, height = abs(x), abs(y)
    steep = height > width
    longer, shorter = (height, width) if steep else (width, height)
    ratio = shorter / (1.0 if longer == 0.0 else longer)
    start = 0
    for border in ATAN_BORDERS:
        start += ratio > border
    tangent = ATAN_TANGENTS[start]
    rest = (ratio - tangent) / (1.0 + ratio * tangent)
    square = rest * rest
    beyond = 0.0
    for coefficient in ATAN_COEFFICIENTS:
        beyond = beyond * square + coefficient
    angle = ATAN_STARTS[start] + (rest + rest * square * beyond)
    if steep:
        angle = HALF_PI - angle
    if x < 0.0:
        angle = PI - angle
    return -angle if y < 0.0 else angle


@inner
def arccos(cosine: float) -> float:
    """The angle of a cosine, rad, 0 to pi; NaN beyond ±1."""
    return arctan2(math.sqrt((1.0 - cosine) * (1.0 + cosine)), cosine)
