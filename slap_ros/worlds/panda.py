# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Franka Emika Panda: limits and forward kinematics, without a simulator.

All poses are in the frame of the base, which stands at the origin, x to the front, z up.
Kinematics: the modified Denavit-Hartenberg parameters and joint limits of Franka's data sheet,
https://frankaemika.github.io/docs/control_parameters.html
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.pose import NO_ROTATION, ORIGIN, Pose, Vector, multiply, rotate

__all__ = [
    "CONTROL_PERIOD_S",
    "FINGER_CLOSED",
    "FINGER_OPEN",
    "GRASP_POINT",
    "HAND",
    "HOME",
    "IMPEDANCE",
    "JOINTS",
    "JOINT_HIGH",
    "JOINT_LOW",
    "LINKS",
    "MAX_STEP",
    "Pose",
    "GraspKinematics",
    "grasp_pose",
    "hand_pose",
    "jacobian",
    "link_poses",
    "vertical_jacobian",
]

JOINTS = 7
JOINT_LOW = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)  # rad
JOINT_HIGH = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)  # rad
MAX_STEP = (0.087, 0.053, 0.087, 0.045, 0.087, 0.057, 0.087)  # rad, either way in a control step
CONTROL_PERIOD_S = 0.125
IMPEDANCE = 3000.0  # N/m of the hand, the most that Franka's own controller takes

FINGER_OPEN, FINGER_CLOSED = 0.04, 0.0  # m, distance of each finger from the middle
GRASP_POINT = 0.1034  # m, from the hand's frame along its z to between the fingertips

LINKS = (
    *(f"link{i}" for i in range(8)),
    "hand",
    "left_finger",
    "right_finger",
)
HAND = LINKS.index("hand")

SQRT_HALF = math.sqrt(0.5)  # sine and cosine of an eighth turn, half of a quarter
# Each joint's frame in the link before it: origin in m, and quarter turns about x.
JOINT_FRAMES: tuple[tuple[Vector, int], ...] = (
    ((0.0, 0.0, 0.333), 0),
    ((0.0, 0.0, 0.0), -1),
    ((0.0, -0.316, 0.0), 1),
    ((0.0825, 0.0, 0.0), 1),
    ((-0.0825, 0.384, 0.0), -1),
    ((0.0, 0.0, 0.0), 1),
    ((0.088, 0.0, 0.0), 1),
)
HAND_FRAME = Pose((0.0, 0.0, 0.107), (0.0, 0.0, -math.sin(math.pi / 8), math.cos(math.pi / 8)))
_GRASP_FRAME = Pose((0.0, 0.0, GRASP_POINT))
FINGER_HEIGHT = 0.0584  # m, along the hand's z
HALF_TURN_Z = (0.0, 0.0, 1.0, 0.0)


def _arm(q: Sequence[float] | NDArray[np.float64]) -> list[Pose]:
    """Poses of link 0 to link 7."""
    position, turn = ORIGIN, NO_ROTATION
    poses = [Pose(position, turn)]
    for angle, (origin, quarter) in zip(q, JOINT_FRAMES, strict=True):
        dx, dy, dz = rotate(turn, origin)
        position = (position[0] + dx, position[1] + dy, position[2] + dz)
        c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
        if quarter:
            joint = (
                quarter * SQRT_HALF * c,
                -quarter * SQRT_HALF * s,
                SQRT_HALF * s,
                SQRT_HALF * c,
            )
        else:
            joint = (0.0, 0.0, s, c)
        turn = multiply(turn, joint)
        poses.append(Pose(position, turn))
    return poses


def hand_pose(q: Sequence[float] | NDArray[np.float64]) -> Pose:
    """Pose of the hand for joint positions in rad; z points out of it, fingers move along y."""
    return _arm(q)[-1].compose(HAND_FRAME)


def grasp_pose(q: Sequence[float] | NDArray[np.float64]) -> Pose:
    """Pose of the point between the fingertips, oriented like the hand."""
    return hand_pose(q).compose(_GRASP_FRAME)


def link_poses(
    q: Sequence[float] | NDArray[np.float64], finger: float, right_finger: float | None = None
) -> list[Pose]:
    """Where all links are.

    The right finger is the left one turned by half a turn about the hand's z, so that both have
    the same shape in their own frames.

    Args:
        q: Joint positions, rad, shape (7,).
        finger: Distance of each finger from the middle, m; or only of the left one.
        right_finger: Distance of the right finger from the middle, m, if it differs from the left
            one's.

    Returns:
        A pose for each of :data:`LINKS`, in the frame of the base.
    """
    poses = _arm(q)
    hand = poses[-1].compose(HAND_FRAME)
    left = Pose(hand.apply((0.0, finger, FINGER_HEIGHT)), hand.quaternion)
    right_y = -finger if right_finger is None else -right_finger
    right = Pose(hand.apply((0.0, right_y, FINGER_HEIGHT)), multiply(hand.quaternion, HALF_TURN_Z))
    poses += [hand, left, right]
    return poses


def jacobian(q: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Velocity of the grasp point per joint velocity, in the base's frame.

    Returns:
        Shape (6, 7): rows 0-2 linear in m/rad, rows 3-5 angular in rad/rad.
    """
    return GraspKinematics(q).jacobian()


def vertical_jacobian(
    q: Sequence[float] | NDArray[np.float64], link: int, point: Vector
) -> tuple[float, ...]:
    """The row of a point's Jacobian for z: how fast the point rises with each joint.

    Args:
        q: Joint positions, rad, shape (7,).
        link: Index of the link, in :data:`LINKS`, that the point moves with.
        point: Point in the base's frame, m.

    Returns:
        m/rad, one for each joint; 0 for joints beyond the link.
    """
    x, y, _ = point
    rates = []
    for joint, pose in enumerate(_arm(q)[1:], start=1):
        ax, ay, _ = rotate(pose.quaternion, (0.0, 0.0, 1.0))  # the joint's axis
        px, py, _ = pose.position
        rates.append(ax * (y - py) - ay * (x - px) if joint <= link else 0.0)
    return tuple(rates)


class GraspKinematics:
    """Kinematics of the grasp point in one configuration, computed once: its pose and Jacobian."""

    __slots__ = ("_links", "grasp")

    def __init__(self, q: Sequence[float] | NDArray[np.float64]) -> None:
        """``q``: joint positions, rad, shape (7,)."""
        self._links = _arm(q)
        self.grasp = self._links[-1].compose(HAND_FRAME).compose(_GRASP_FRAME)

    def jacobian(self) -> NDArray[np.float64]:
        """The Jacobian of this configuration; see :func:`jacobian`."""
        gx, gy, gz = self.grasp.position
        columns = []
        for link in self._links[1:]:
            x, y, z = rotate(link.quaternion, (0.0, 0.0, 1.0))  # the joint's axis
            px, py, pz = link.position
            rx, ry, rz = gx - px, gy - py, gz - pz
            columns.append((y * rz - z * ry, z * rx - x * rz, x * ry - y * rx, x, y, z))
        return np.array(list(zip(*columns, strict=True)))


# The grasp point is at (0.5, 0, 0.5) m, the hand points straight down, the fingers move along y.
HOME = (
    0.0,
    -0.18599447830531982,
    0.0,
    -1.836675282040641,
    0.0,
    1.650680803735321,  # joint 2 less joint 4: the hand is upright
    math.pi / 4,
)
