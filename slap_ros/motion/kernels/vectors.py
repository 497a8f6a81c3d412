# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors and matrices of plain numbers: unlike small arrays, they need no memory of their own."""

from __future__ import annotations

from slap_ros.compilation import inner
from slap_ros.geometry.pose import Vector
from slap_ros.motion.joints import Array

Matrix = tuple[Vector, Vector, Vector]  # its rows


@inner
def vector(row: Array) -> Vector:
    """Three numbers of an array."""
    return row[0], row[1], row[2]


@inner
def matrix(rows: Array) -> Matrix:
    """The first three columns of three rows of an array."""
    return vector(rows[0]), vector(rows[1]), vector(rows[2])


@inner
def transposed(rows: Matrix) -> Matrix:
    """The columns of a matrix."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return (a, d, g), (b, e, h), (c, f, i)


@inner
def dot(a: Vector | Array, b: Vector | Array) -> float:
    """The inner product of two vectors, shape (3,)."""
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@inner
def applied(rows: Matrix, a: Vector) -> Vector:
    """A matrix times a vector."""
    return dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)


@inner
def total(a: Vector, b: Vector) -> Vector:
    """The sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner
def difference(a: Vector, b: Vector) -> Vector:
    """One vector less another."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def scaled(factor: float, a: Vector) -> Vector:
    """A vector times a number."""
    return factor * a[0], factor * a[1], factor * a[2]


@inner
def absolute(a: Vector) -> Vector:
    """The vector with every coordinate at least 0."""
    return abs(a[0]), abs(a[1]), abs(a[2])
