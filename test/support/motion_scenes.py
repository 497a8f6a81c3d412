# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Poses, boxes and scenes that the tests of motion share."""

import math

import numpy as np

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.worlds.panda import HOME, JOINT_HIGH, JOINT_LOW, Pose

STRAIGHT = (0.0, 0.0, 0.0, 1.0)
HALF = (0.025, 0.025, 0.025)  # m, of a block
TABLE = OrientedBox(Pose((0.5, 0.0, -0.175), STRAIGHT), (0.25, 0.4, 0.25))  # its top at z = 0.075 m
HELD = OrientedBox(Pose(), HALF)
START = np.array(HOME)


def block(x, y, z, yaw=0.0):
    return OrientedBox(Pose((x, y, z), (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))), HALF)


def tower(x, y, blocks=3):
    return [block(x, y, 0.1 + 0.05 * i) for i in range(blocks)]


def top_down(x, y, z, yaw=0.0):
    """A pose of the grasp point with the hand pointing straight down."""
    return Pose((x, y, z), (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0))


def random_configurations(rng, count):
    return rng.uniform(JOINT_LOW, JOINT_HIGH, (count, 7))


def random_box(rng):
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    position = rng.uniform((-0.2, -0.6, 0.0), (0.8, 0.6, 0.9))
    half = rng.uniform(0.02, 0.15, 3)
    return OrientedBox(
        Pose(tuple(position.tolist()), tuple(quaternion.tolist())), tuple(half.tolist())
    )
