# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics of the Panda: free configurations at a pose, over all of its redundancy.

The closed form is in :mod:`slap_ros.motion.numpy_inverse_kinematics`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from slap_ros.geometry.pose import Pose
from slap_ros.motion.collision import CollisionChecker
from slap_ros.motion.free_space import FreeSpace, free_space
from slap_ros.motion.joints import Array, Free, Joints, configuration, within_limits
from slap_ros.motion.kinematics import matrix
from slap_ros.motion.numpy_inverse_kinematics import ik_branches, solutions, sweep
from slap_ros.worlds.panda import JOINTS


def inverse_kinematics(target: Pose, near: Joints, *, free: Free | None = None) -> Joints | None:
    """The free configuration at a pose that is the fewest control steps away.

    Exact to rounding in the pose; over the redundancy it is the nearest of a sweep that is refined
    around its best. Deterministic.

    Args:
        target: Pose of the grasp point in the base's frame.
        near: Configuration to be near to, rad, shape (7,).
        free: Checker of which configurations are free of collisions; None: all are.

    Returns:
        rad, shape (7,); None if the pose is out of reach or no configuration there is free.
    """
    return nearest_configurations([target], near, free=free)[0]


def nearest_configurations(
    targets: Sequence[Pose], near: Joints, *, free: Free | None = None
) -> list[Joints | None]:
    """What :func:`inverse_kinematics` gives for each of some poses, found together.

    Args:
        targets: Poses of the grasp point in the base's frame.
        near: Configuration to be near to, rad, shape (7,).
        free: Checker of which configurations are free of collisions; None: all are.

    Returns:
        For each pose rad, shape (7,); None if it is out of reach or no configuration there is free.
    """
    space = _everywhere() if free is None else free_space(free)
    frames = np.array([matrix(target) for target in targets]).reshape(-1, 4, 4)
    found = space.nearest_configurations(frames, configuration(near))
    reached = np.atleast_1d(np.isfinite(found).all(axis=-1))
    return [q if is_reached else None for q, is_reached in zip(found, reached, strict=True)]


def ik_candidates(target: Pose, near: Joints) -> Joints:
    """Configurations at a pose, over all branches and redundancy values, the nearest first.

    Args:
        target: Pose of the grasp point in the base's frame.
        near: Configuration to be near to, rad, shape (7,).

    Returns:
        rad, shape (k, 7); k is 0 if the pose is out of reach.
    """
    return solutions(matrix(target)[None], [sweep(near)], near)[0]


def ik_solutions(target: Pose, joint7: Array, joint1: float = 0.0) -> Joints:
    """All configurations at a pose with one of the given values of joint 7.

    Args:
        target: Pose of the grasp point in the base's frame.
        joint7: Values of joint 7, rad, shape (m,).
        joint1: Value of joint 1 where the upper arm is upright and joint 1 is free, rad.

    Returns:
        rad, shape (k, 7), within the limits.
    """
    q = ik_branches(matrix(target)[None], joint7, joint1).reshape(-1, JOINTS)
    return q[within_limits(q)]


@cache
def _everywhere() -> FreeSpace:
    """The free space without obstacles."""
    return CollisionChecker([], base=False).space
