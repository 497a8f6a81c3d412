# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Classifiers and margins that predicates of several domains are made of."""

from __future__ import annotations

import numpy as np

from slap_ros.relational import Column, State, Type
from slap_ros.relational.predicates import Bools, Classifier
from slap_ros.relational.state import Array

TINY = float(np.finfo(np.float64).tiny)


def always(state: State, column: Column) -> Bools:
    """True of every object: for predicates that an object's type alone decides."""
    return np.ones((*state.data.shape[:-1], len(column.objects)), dtype=bool)


def is_a(kind: Type) -> Classifier:
    """The classifier of objects of a type, or of one below it."""

    def classifier(state: State, column: Column) -> Bools:
        truth = np.array([obj.type.is_a(kind) for obj in column.objects])
        return np.broadcast_to(truth, (*state.data.shape[:-1], len(truth)))

    return classifier


def flag(state: State, column: Column, feature: str) -> Bools:
    """Whether a feature that is 0 or 1 is 1.

    Args:
        state: One state, or a batch.
        column: Objects whose feature is read.
        feature: Name of the feature.

    Returns:
        Shape (..., objects).
    """
    return state.stack(column, feature) > 0.5


def has_flag(feature: str) -> Classifier:
    """The classifier of objects whose feature is 1."""
    return lambda state, column: flag(state, column, feature)


def lacks_flag(feature: str) -> Classifier:
    """The classifier of objects whose feature is 0."""
    return lambda state, column: ~flag(state, column, feature)


def is_held(state: State, _: Column, block: Column) -> Bools:
    """Whether the robot, of which there is one, holds a block."""
    return flag(state, block, "held")


def is_not_held(state: State, _: Column, block: Column) -> Bools:
    """Whether the robot does not hold a block."""
    return ~flag(state, block, "held")


def none_is_held(state: State, blocks: Column) -> Bools:
    """Whether none of the blocks is held, shape (..., 1): the gripper is empty."""
    empty: Bools = ~np.logical_or.reduce(flag(state, blocks, "held"), axis=-1, keepdims=True)
    return empty


def strictly(margin: Array) -> Array:
    """Make a negated margin false at 0, where the original still holds."""
    return margin - TINY
