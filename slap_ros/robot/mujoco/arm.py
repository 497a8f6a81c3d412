# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Panda in MuJoCo: links and meshes of PyBullet's URDF, with motors that hold by stiffness.

Each joint is pulled to its commanded position, as by a drive's position loop: a moving arm lags.
Its own weight is compensated, that of what it holds is not. Both fingers move alike, as the real
gripper's do, and press with a force that is set.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import InvalidParameterError
from slap_ros.files import read_text
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.mujoco.engine import mujoco
from slap_ros.worlds.bullet import PANDA
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, JOINTS

PERIOD_S = 0.002  # of the physics and of the controllers
ARM_JOINTS = tuple(f"panda_joint{i + 1}" for i in range(JOINTS))
FINGER_JOINTS = ("panda_finger_joint1", "panda_finger_joint2")

# Softer than a position controller's, whose arm jams where it meets something, and harder than an
# impedance controller's, whose arm would sag under a block by a centimetre.
STIFFNESS = (1100.0, 1100.0, 900.0, 900.0, 500.0, 500.0, 500.0)  # Nm/rad
LAG_S = 0.07  # s
TORQUE = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)  # Nm, Franka's data sheet
ARMATURE = 0.1  # kg m², of a motor, seen from the joint
JOINT_DAMPING = 1.0  # Nm s/rad

FINGER_ARMATURE = 0.1  # kg
FINGER_FORCE = 70.0  # N, of each finger
LARGEST_FINGER_FORCE = 70.0  # N, Franka's data sheet
FINGER_SPEED = 0.05  # m/s, of each finger, Franka's data sheet

Numbers = Sequence[float] | NDArray[np.float64]

# Who touches whom: the arm touches everything but itself.
ARM_CONTACTS = {"contype": 2, "conaffinity": 1}
BODY_CONTACTS = {"contype": 1, "conaffinity": 3}
# Hard contacts, for the step is short: fingers that press a toy of 10 g do not sink into it.
SOLREF = (2.0 * PERIOD_S, 1.0)  # s, 1: time constant and damping ratio
SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
NO_SLIP_ITERATIONS = 5  # of the solver that takes the creeping out of friction


class MotorLaw(NamedTuple):
    """What makes the torque of a joint's motor, besides its limit."""

    gain: float  # of the command
    stiffness: float  # Nm/rad, against the joint's position
    damping: float  # Nm s/rad


class ArmControl(Protocol):
    """How an arm goes to joint positions."""

    def motor(self, usual: float) -> MotorLaw:
        """The motor of a joint that is usually so stiff, Nm/rad."""
        ...

    def commands(self, told: Numbers, joints: Numbers, velocities: Numbers) -> Numbers:
        """What the motors are told for a period, shape (7,).

        Args:
            told: Joint positions to go to, rad, shape (7,).
            joints: Joint positions, rad, shape (7,).
            velocities: Joint velocities, rad/s, shape (7,).
        """
        ...

    def replacing(self, points: Sequence[TrajectoryPoint]) -> Sequence[TrajectoryPoint]:
        """A short trajectory as the arm follows it that replaces the one before.

        Args:
            points: Points of the trajectory.
        """
        ...


FINGER_MOTOR = MotorLaw(4000.0, 4000.0, 80.0)  # N/m, N/m, N s/m


@dataclass(frozen=True)
class ArmMotors:
    """How hard the arm's motors pull joints to their commands, up to the Panda's torques.

    Args:
        stiffness: How many times as stiff as ``STIFFNESS`` each joint is.
        lag_s: Time by which a joint in motion is behind its command, s: damping over stiffness.

    Raises:
        InvalidParameterError: One is not above 0.
    """

    stiffness: float = 1.0
    lag_s: float = LAG_S

    def __post_init__(self) -> None:
        """Check that a motor can be so."""
        for name, value in (("stiffness", self.stiffness), ("lag_s", self.lag_s)):
            if not 0.0 < value < math.inf:
                raise InvalidParameterError(f"{name} of an arm's motors is {value}, not above 0")

    def motor(self, usual: float) -> MotorLaw:
        """A motor that pulls its joint to the command."""
        stiffness = self.stiffness * usual
        return MotorLaw(stiffness, stiffness, self.lag_s * stiffness)

    def commands(self, told: Numbers, joints: Numbers, velocities: Numbers) -> Numbers:  # noqa: ARG002
        """The joint positions to go to, since the motors pull there.

        Args:
            told: Joint positions to go to, rad, shape (7,).
            joints: Joint positions, rad, shape (7,).
            velocities: Joint velocities, rad/s, shape (7,).

        Returns:
            The first of them.
        """
        return told

    def replacing(self, points: Sequence[TrajectoryPoint]) -> Sequence[TrajectoryPoint]:
        """The trajectory itself: stiff joints that jumped would jerk."""
        return points


JOINT_POSITIONS = ArmMotors()


def arm_spec(control: ArmControl = JOINT_POSITIONS) -> Any:
    """A new ``mujoco.MjSpec`` with the arm alone, its base at the origin.

    Args:
        control: How it goes to joint positions.
    """
    spec = mujoco.MjSpec.from_string(_urdf())
    _set_options(spec.option)
    for body in spec.bodies:
        body.gravcomp = 1.0
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = ARM_CONTACTS["contype"], ARM_CONTACTS["conaffinity"]
        geom.solref, geom.solimp, geom.condim = SOLREF, SOLIMP, 4
    for joint in spec.joints:
        finger = joint.name in FINGER_JOINTS
        joint.armature = FINGER_ARMATURE if finger else ARMATURE
        joint.damping = [0.0 if finger else JOINT_DAMPING, 0.0, 0.0]
        joint.actfrclimited = False  # the URDF's efforts: 20 N of each finger; motors have theirs
    for i, name in enumerate(ARM_JOINTS):
        spec.joint(name).range = [JOINT_LOW[i], JOINT_HIGH[i]]  # the URDF's are wider
        _add_motor(spec, name, control.motor(STIFFNESS[i]), TORQUE[i])
    for name in FINGER_JOINTS:
        _add_motor(spec, name, FINGER_MOTOR, FINGER_FORCE)
    _couple_fingers(spec)
    return spec


def _urdf() -> str:
    """PyBullet's URDF with paths and settings that MuJoCo understands."""
    text = read_text(PANDA / "panda.urdf")
    for prefix in ("package://meshes/collision/", "package://meshes/visual/"):
        text = text.replace(prefix, "")
    head, _, rest = text.partition("<robot")
    tag, _, body = rest.partition(">")
    settings = (
        f'<mujoco><compiler meshdir="{PANDA / "meshes" / "collision"}" discardvisual="true" '
        'fusestatic="false" balanceinertia="true"/></mujoco>'
    )
    return f"{head}<robot{tag}>{settings}{body}"


def _set_options(option: Any) -> None:
    option.timestep = PERIOD_S
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10.0  # what is held creeps less
    # Without it, fingers that press a toy of 10 g with 70 N slide along its sides by centimetres.
    option.noslip_iterations = NO_SLIP_ITERATIONS


def _add_motor(spec: Any, joint: str, law: MotorLaw, force: float) -> None:
    """The motor of a joint, with the most that it can do: Nm of the arm's, N of the fingers'."""
    motor = spec.add_actuator()
    motor.name, motor.target, motor.trntype = joint, joint, mujoco.mjtTrn.mjTRN_JOINT
    motor.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    motor.gainprm[0] = law.gain
    motor.biasprm[1], motor.biasprm[2] = -law.stiffness, -law.damping
    motor.forcerange, motor.forcelimited = [-force, force], True


def _couple_fingers(spec: Any) -> None:
    """One drive moves both fingers, so that what they hold stays where they met it."""
    for made_of_the_urdf in list(spec.equalities):
        spec.delete(made_of_the_urdf)
    both = spec.add_equality()
    both.name, both.type = "fingers", mujoco.mjtEq.mjEQ_JOINT
    both.objtype = mujoco.mjtObj.mjOBJ_JOINT
    both.name1, both.name2 = FINGER_JOINTS
    both.data[:5] = [0.0, 1.0, 0.0, 0.0, 0.0]  # the first is the second
    both.solref, both.solimp = SOLREF, SOLIMP
