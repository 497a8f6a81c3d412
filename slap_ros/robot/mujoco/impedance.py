# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An arm whose hand is pulled to its place by springs and dampers, with limited force.

That is Cartesian impedance control, as arms with torque control have it. What the hand presses on
is pressed with the limited force, however far inside of it the hand is told to be. The contact
world pulls its hand alike.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Pose
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.mujoco.arm import TORQUE, ArmControl, ArmMotors, MotorLaw, Numbers
from slap_ros.worlds.contact.hand import rotation_between
from slap_ros.worlds.contact.hand_model import PANDA
from slap_ros.worlds.panda import IMPEDANCE, GraspKinematics, grasp_pose

DAMPING = 3.3  # √kg: times √stiffness it is N s/m, .7 of critical for the arm that moves along
FORCE = PANDA.pull_n  # N, along each axis of the base at most
MOMENT = 8.0  # Nm, about each axis of the base at most
TURN_STIFFNESS, TURN_DAMPING = 300.0, 15.0  # Nm/rad and Nm s/rad, about each axis of the base
# Of joints, where that does not move the hand: the elbow goes where it was told to be.
POSTURE_STIFFNESS, POSTURE_DAMPING = 60.0, 8.0  # Nm/rad and Nm s/rad
SINGULAR = 1e-9  # of a row of the Jacobian: what is left of it where others say the same


@dataclass(frozen=True)
class HandImpedance:
    """How an arm pulls its hand to where joint positions have it, and its elbow as well.

    Args:
        stiffness: Stiffness of the hand along each axis of the base, N/m.

    Raises:
        InvalidParameterError: It is not above 0.
    """

    stiffness: float = IMPEDANCE

    def __post_init__(self) -> None:
        """Check that a hand can be held so."""
        if not 0.0 < self.stiffness < math.inf:
            raise InvalidParameterError(
                f"stiffness of a hand's impedance is {self.stiffness}, not above 0"
            )

    def motor(self, usual: float) -> MotorLaw:  # noqa: ARG002
        """A motor whose torque is its command."""
        return MotorLaw(1.0, 0.0, 0.0)

    def replacing(self, points: Sequence[TrajectoryPoint]) -> Sequence[TrajectoryPoint]:
        """The trajectory's end at once: the force that pulls the hand there is limited."""
        return [TrajectoryPoint(point.time_s, points[-1].positions) for point in points]

    def commands(self, told: Numbers, joints: Numbers, velocities: Numbers) -> list[float]:
        """Torques of the joints, Nm, besides those that carry the arm.

        Args:
            told: Joint positions to go to, rad, shape (7,).
            joints: Joint positions, rad, shape (7,).
            velocities: Joint velocities, rad/s, shape (7,).

        Returns:
            None of them beyond a Panda's.
        """
        now, rates = GraspKinematics(joints), [float(v) for v in velocities]
        goal = _goal(tuple(map(float, told)))
        rows = now.jacobian().tolist()
        *speed, wx, wy, wz = (_product(row, rates) for row in rows)
        damping = DAMPING * math.sqrt(self.stiffness)
        way = zip(goal.position, now.grasp.position, speed, strict=True)
        turn = zip(rotation_between(now.grasp, goal), (wx, wy, wz), strict=True)
        wrench = [_within(self.stiffness * (to - at) - damping * v, FORCE) for to, at, v in way]
        wrench += [_within(TURN_STIFFNESS * r - TURN_DAMPING * w, MOMENT) for r, w in turn]
        posture = [
            POSTURE_STIFFNESS * (float(to) - float(at)) - POSTURE_DAMPING * rate
            for to, at, rate in zip(told, joints, rates, strict=True)
        ]
        unmoved = _null_space_part(rows, posture)
        columns = zip(*rows, strict=True)
        torques = [_product(each, wrench) + p for each, p in zip(columns, unmoved, strict=True)]
        # All of them: a joint that gave less than the others would tilt the hand.
        excess = max(
            1.0, *(abs(torque) / most for torque, most in zip(torques, TORQUE, strict=True))
        )
        return [torque / excess for torque in torques]


@lru_cache(maxsize=1)
def _goal(told: tuple[float, ...]) -> Pose:
    """Where joint positions have the grasp; they are the same for a control period."""
    return grasp_pose(told)


# Plain Python: numpy's linear algebra has other last bits on other processors, and contact
# amplifies them.


def _product(some: Sequence[float], others: Sequence[float]) -> float:
    return math.fsum(map(operator.mul, some, others))


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _null_space_part(rows: Sequence[Sequence[float]], vector: Sequence[float]) -> Sequence[float]:
    """The part of a vector that is orthogonal to all rows, by Gram and Schmidt.

    Args:
        rows: Rows of a matrix, shape (n, m).
        vector: Shape (m,).
    """
    directions: list[Sequence[float]] = []
    for row in rows:
        left = _orthogonal_part(row, directions)
        length = math.sqrt(_product(left, left))
        if length > SINGULAR:
            directions.append([value / length for value in left])
    return _orthogonal_part(vector, directions)


def _orthogonal_part(
    vector: Sequence[float], directions: Sequence[Sequence[float]]
) -> Sequence[float]:
    """A vector without its parts along orthonormal directions."""
    for direction in directions:
        along = _product(vector, direction)
        vector = [value - along * d for value, d in zip(vector, direction, strict=True)]
    return vector


def arm_control(impedance: float, stiffness: float, lag_s: float) -> ArmControl:
    """The control that numbers stand for.

    Args:
        impedance: Stiffness of the hand, N/m; 0: that of joints counts.
        stiffness: How many times as stiff as usual joints are.
        lag_s: Time by which a joint in motion is behind its command, s.

    Raises:
        InvalidParameterError: One is not above 0 that counts.
    """
    return HandImpedance(impedance) if impedance != 0.0 else ArmMotors(stiffness, lag_s)
