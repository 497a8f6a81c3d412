# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Functions that give the same bits on every processor.

numpy's own ``exp``, ``tanh``, ``sin`` and ``arctan2`` do not, nor do the C library's: they choose
an implementation for the processor, and the last bit differs. Here they are made of sums, products,
quotients, square roots and roundings alone, which IEEE 754 defines to the bit. Values that a
library computed still differ in their last bits. Rounding them to a grid (:func:`on_grid`) hides
that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Float = TypeVar("Float", np.float32, np.float64)

# In rad, m, or parts of an action's range. Four micrometres are far below what a robot's joints
# repeat. A power of two, so that products and quotients with it are exact.
RESOLUTION = 2.0**-18
PER_UNIT = 2.0**18  # multiples of it in 1; exact, and times faster than over
LN_2 = 0.6931471805599453
LOG2_E = 1.4426950408889634
LARGEST_EXPONENT = 700.0  # exp of it is still finite
# Taylor coefficients of exp from x^9 down: below ln(2) / 2 the rest is less than 1e-11.
EXP_COEFFICIENTS = tuple(1.0 / math.factorial(power) for power in range(9, -1, -1))
EXPONENT_BIAS, MANTISSA_BITS = 1023, 52  # of a 64-bit float's exponent, and those below it
SATURATED = 20.0  # where tanh differs from 1 by 1e-17
UNSURE = 1e-5  # of the resolution, 4e-11: no two implementations of tanh differ by so much

PI, HALF_PI = 3.141592653589793, 1.5707963267948966
QUARTER_TURNS = 0.6366197723675814  # in a radian
# A quarter turn in two parts: the first has 33 bits, so that its multiples are exact.
QUARTER_HIGH, QUARTER_LOW = 1.5707963267341256, 6.077100506506192e-11
# Taylor coefficients of (sin r - r) / r^3 and (cos r - 1) / r^2 as polynomials in r^2, the highest
# power first: up to an eighth of a turn the rest is less than 1e-17.
SIN_COEFFICIENTS = tuple((-1.0) ** n / math.factorial(2 * n + 1) for n in range(8, 0, -1))
COS_COEFFICIENTS = tuple((-1.0) ** n / math.factorial(2 * n) for n in range(8, 0, -1))
# The arc tangent begins at the nearest multiple of pi/16: these, their tangents, and the tangents
# half-way between them. Written out, for a library would round them as the processor does.
ATAN_STARTS = 0.0, 0.19634954084936207, 0.39269908169872414, 0.5890486225480862, 0.7853981633974483
ATAN_TANGENTS = 0.0, 0.198912367379658, 0.41421356237309503, 0.6681786379192989, 1.0
ATAN_BORDERS = 0.09849140335716425, 0.3033466836073424, 0.5345111359507917, 0.8206787908286604
# Taylor coefficients of (atan u - u) / u^3 as a polynomial in u^2; |u| is at most tan(pi/32).
ATAN_COEFFICIENTS = tuple((-1.0) ** n / (2 * n + 1) for n in range(8, 0, -1))


def on_grid(values: NDArray[Float]) -> NDArray[Float]:
    """Values rounded to the nearest multiple of ``RESOLUTION``, of the same shape and type.

    Values that differ in their last bits become equal, except where an odd multiple of half the
    resolution lies between them: about one pair in 10^10 of 64-bit values near 1. Zero has no sign.
    """
    rounded: NDArray[Float] = np.rint(values * PER_UNIT)
    rounded *= RESOLUTION  # in place here and below: half of the time was new arrays
    rounded += 0.0
    return rounded


def exp(values: Array) -> Array:
    """The exponential function, to a relative error of 1e-11.

    It is 2^k exp(r) with |r| ≤ ln(2) / 2, where exp(r) is a Taylor polynomial.

    Args:
        values: Exponents of any shape, none of them NaN; beyond ±700 they count as ±700.
    """
    return _exp(np.clip(values, -LARGEST_EXPONENT, LARGEST_EXPONENT))


def _exp(values: Array) -> Array:
    """The same of exponents within ±700, whose array is used up."""
    k = np.rint(values * LOG2_E)
    values -= k * LN_2
    result = _polynomial(EXP_COEFFICIENTS, values)
    power_of_two = (k.astype(np.int64) + EXPONENT_BIAS) << MANTISSA_BITS
    result *= power_of_two.view(np.float64)
    return result


def tanh(values: Array) -> Array:
    """The hyperbolic tangent, to an absolute error of 1e-11; NaN where a value is NaN.

    Args:
        values: Numbers of any shape.
    """
    shrunk = _exp(-2.0 * np.fmin(np.abs(values), SATURATED))  # 20 of NaN
    result = 1.0 - shrunk
    shrunk += 1.0
    result /= shrunk
    result = np.copysign(result, values)
    result += 0.0  # zero has no sign
    return np.where(np.isnan(values), np.nan, result)


def tanh_on_grid(values: Array) -> Array:
    """``on_grid(tanh(values))`` to the bit, three times as fast.

    The library's own function differs from ours in digits that rounding hides. Only where it may
    not, because the value is half-way between two multiples of the resolution, ours decides.

    Args:
        values: Numbers of any shape.
    """
    scaled = np.tanh(values)
    scaled *= PER_UNIT
    rounded: Array = np.rint(scaled)
    scaled -= rounded
    unsure = np.abs(scaled, out=scaled) > 0.5 - UNSURE
    rounded *= RESOLUTION
    if unsure.any():
        rounded[unsure] = on_grid(tanh(values[unsure]))
    rounded += 0.0
    return rounded


def sin_cos(angles: Array) -> tuple[Array, Array]:
    """Sine and cosine, to an absolute error of 2e-16; NaN where an angle is NaN.

    Args:
        angles: Angles of any shape, rad, up to a million turns.
    """
    quarters = np.rint(angles * QUARTER_TURNS)
    rest = (angles - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW
    square = rest * rest
    sine = rest + rest * square * _polynomial(SIN_COEFFICIENTS, square)
    cosine = 1.0 + square * _polynomial(COS_COEFFICIENTS, square)
    quadrant = quarters - 4.0 * np.floor(quarters * 0.25)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine, cosine = np.where(odd, cosine, sine), np.where(odd, sine, cosine)
    return (
        np.where(quadrant >= 2.0, -sine, sine),
        np.where((quadrant == 1.0) | (quadrant == 2.0), -cosine, cosine),
    )


def arctan2(y: Array, x: Array) -> Array:
    """The angle of a vector, -pi to pi, to an absolute error of 1e-15; 0 for no vector.

    Args:
        y: Second coordinates.
        x: First coordinates, of a shape that can be broadcast with that of ``y``. Zeros have no
            sign here.
    """
    width, height = np.abs(x), np.abs(y)
    steep = height > width
    longer, shorter = np.where(steep, height, width), np.where(steep, width, height)
    ratio = shorter / np.where(longer == 0.0, 1.0, longer)
    start = np.searchsorted(ATAN_BORDERS, ratio)
    start = np.where(np.isnan(ratio), 0, start)
    tangent = np.array(ATAN_TANGENTS)[start]
    rest = (ratio - tangent) / (1.0 + ratio * tangent)
    square = rest * rest
    beyond = rest + rest * square * _polynomial(ATAN_COEFFICIENTS, square)
    angle = np.array(ATAN_STARTS)[start] + beyond
    angle = np.where(steep, HALF_PI - angle, angle)
    angle = np.where(x < 0.0, PI - angle, angle)
    signed: Array = np.where(y < 0.0, -angle, angle)
    return signed


def arccos(cosines: Array) -> Array:
    """The angle of a cosine, 0 to pi, to an absolute error of 1e-15; NaN beyond ±1."""
    sines: Array = np.sqrt((1.0 - cosines) * (1.0 + cosines))
    return arctan2(sines, cosines)


def _polynomial(coefficients: Sequence[float], values: Array) -> Array:
    """A polynomial by Horner's rule, the coefficient of the highest power first."""
    result = np.full_like(values, coefficients[0])
    for coefficient in coefficients[1:]:
        result *= values
        result += coefficient
    return result
