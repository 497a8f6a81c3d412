# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An arm whose hand is pulled to its place by springs and dampers, with limited force.

That is Cartesian impedance control, as arms with torque control have it. What the hand presses on
is pressed with the limited force, however far inside of it the hand is told to be. The contact
world pulls its hand alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidParameterError
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.mujoco.arm import TORQUE, ArmControl, ArmMotors, MotorLaw, Numbers
from slap_ros.worlds.contact.hand import rotation_between
from slap_ros.worlds.contact.hand_model import PANDA, PANDA_STIFFNESS
from slap_ros.worlds.panda import JOINTS, GraspKinematics, grasp_pose

DAMPING = 3.3  # √kg: times √stiffness it is N s/m, .7 of critical for the arm that moves along
FORCE = PANDA.pull_n  # N, along each axis of the base at most
MOMENT = 8.0  # Nm, about each axis of the base at most
TURN_STIFFNESS, TURN_DAMPING = 300.0, 15.0  # Nm/rad and Nm s/rad, about each axis of the base
# Of joints, where that does not move the hand: the elbow goes where it was told to be.
POSTURE_STIFFNESS, POSTURE_DAMPING = 60.0, 8.0  # Nm/rad and Nm s/rad

Torques = NDArray[np.float64]


@dataclass(frozen=True)
class HandImpedance:
    """How an arm pulls its hand to where joint positions have it, and its elbow as well.

    Args:
        stiffness: Stiffness of the hand along each axis of the base, N/m.

    Raises:
        InvalidParameterError: It is not above 0.
    """

    stiffness: float = PANDA_STIFFNESS

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

    def commands(self, told: Numbers, joints: Numbers, velocities: Numbers) -> Numbers:
        """Torques of the joints, Nm, shape (7,), besides those that carry the arm.

        Args:
            told: Joint positions to go to, rad, shape (7,).
            joints: Joint positions, rad, shape (7,).
            velocities: Joint velocities, rad/s, shape (7,).

        Returns:
            None of them beyond a Panda's.
        """
        now, goal, rates = GraspKinematics(joints), grasp_pose(told), np.asarray(velocities)
        jacobian = now.jacobian()
        speed = jacobian @ rates
        way = np.subtract(goal.position, now.grasp.position)
        turn = np.array(rotation_between(now.grasp, goal))
        damping = DAMPING * math.sqrt(self.stiffness)
        force = np.clip(self.stiffness * way - damping * speed[:3], -FORCE, FORCE)
        moment = np.clip(TURN_STIFFNESS * turn - TURN_DAMPING * speed[3:], -MOMENT, MOMENT)
        posture = POSTURE_STIFFNESS * np.subtract(told, joints) - POSTURE_DAMPING * rates
        unmoved = np.eye(JOINTS) - jacobian.T @ np.linalg.pinv(jacobian.T)
        torques = jacobian.T @ np.concatenate([force, moment]) + unmoved @ posture
        # All of them: a joint that gave less than the others would tilt the hand.
        limited: Torques = torques / max(1.0, *(np.abs(torques) / TORQUE))
        return limited


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
