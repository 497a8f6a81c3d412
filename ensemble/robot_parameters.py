# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of a robot, real or simulated, which the command line sets as well."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

from ensemble.camera_parameters import CameraParameters
from ensemble.parameters import MAX_SEED, parameter, parse_parameters, with_default
from ensemble.world_parameters import WorldParameters
from slap_ros.errors import InvalidParameterError
from slap_ros.robot.blending import MotionLimits
from slap_ros.robot.franka.arm import COLLISION_FORCE, COLLISION_TORQUE, FrankaSettings
from slap_ros.robot.franka.limits import JERK, franka_limits
from slap_ros.robot.limits import FR3, Limits, Workspace, arm_limits
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.worlds.panda import IMPEDANCE, JOINTS

# As MoveIt's configurations of Franka's arms have them; ``ros2 action list`` shows them.
TRAJECTORY_ACTION = "ARM_arm_controller/follow_joint_trajectory"
BRIDGES = frozenset({"robot_bridge", "servo_bridge"})  # names of nodes that command an arm
TRAJECTORY_TOPIC = "ARM_arm_controller/joint_trajectory"
GRIPPER_ACTION = "franka_gripper/gripper_action"
# Of the bridge to a robot in MuJoCo, where tables, which are as high as domains want, stop the arm.
BEFORE_MUJOCO: Mapping[str, float | tuple[float, ...]] = MappingProxyType(
    {"workspace": (-0.9, -0.9, -0.4, 0.9, 0.9, 1.2), "gripper_effort": 70.0}
)
# At a bench fingers press as hard as those of the contact world (``HandModel``).
BEFORE_MUJOCO_AT_A_BENCH = MappingProxyType({**BEFORE_MUJOCO, "gripper_effort": 40.0})
MUJOCO_AT_A_BENCH = MappingProxyType({"impedance": IMPEDANCE})  # of the robot itself
OF_JOINTS = frozenset({"stiffness", "lag"})  # who sets one of these has joints pulled instead
Parameters = Mapping[str, str | int | float | tuple[float, ...]]
WORKSPACE = (*Workspace().low, *Workspace().high)
BENCH = (0.2, -0.5, 0.0, 0.8, 0.5, 0.9)  # m: tables at a bench are as high as the arm's base
GIVEN_WITH_THE_RUN = frozenset(item.name for item in fields(WorldParameters)) | {"scene"}


def action_name(name: str, arm: str) -> str:
    """An action's name for an arm: ``ARM`` in it is replaced."""
    return name.replace("ARM", arm)


def arm_joints(arm: str) -> list[str]:
    """Names of an arm's joints."""
    return [f"{arm}_joint{i + 1}" for i in range(JOINTS)]


def finger_joints(arm: str) -> list[str]:
    """Names of the joints of its two fingers."""
    return [f"{arm}_finger_joint{i + 1}" for i in range(2)]


def base_frame(arm: str) -> str:
    """Name of the frame of its base."""
    return f"{arm}_link0"


@dataclass(frozen=True)
class RobotParameters:
    """What a robot is, and how well it is measured: see the docstring of ``robot_bridge.node``."""

    arm: str = parameter("panda", "panda or fr3")
    scene: str = parameter("", "a scene file; empty: the sampled task's objects")
    workspace: tuple[float, ...] = parameter(
        WORKSPACE, "m, fingertips, lowest x y z, highest", low=-10.0
    )
    gripper_action: str = parameter(GRIPPER_ACTION, "the gripper's controller")
    gripper_scale: float = parameter(0.5, "position to be sent per m between the fingers")
    gripper_effort: float = parameter(20.0, "N")
    position_noise: float = parameter(0.002, "m, of detections, along each axis")
    turn_noise: float = parameter(0.01, "rad, of detections, about each axis")
    joint_timeout: float = parameter(0.5, "s without joint positions until the robot holds")
    hidden_after: int = parameter(
        0, "pictures in a row without an object after which it is where it was; 0: never", high=64
    )

    @property
    def space(self) -> Workspace:
        """Where the fingertips may be.

        Raises:
            InvalidParameterError: It has not six numbers, or is empty.
        """
        if len(self.workspace) != len(WORKSPACE):
            raise InvalidParameterError(
                "parameter workspace is x y z at its lowest and at its highest"
            )
        x, y, z, to_x, to_y, to_z = self.workspace
        return Workspace((x, y, z), (to_x, to_y, to_z))

    @property
    def tracking(self) -> TrackingSettings:
        """How well detections can be trusted, and when an object is taken to be hidden."""
        return TrackingSettings(
            self.position_noise, self.turn_noise, hidden_after=self.hidden_after
        )


@dataclass(frozen=True)
class PointToPointParameters(RobotParameters):
    """Those of a robot that moves from rest to rest, one goal of its controllers at a time."""

    speed: float = parameter(0.5, "fraction of the velocity and acceleration limits")
    trajectory_action: str = parameter(TRAJECTORY_ACTION, "the arm's controller")
    controller_timeout: float = parameter(0.5, "s that a controller may take longer than it should")
    gripper_timeout: float = parameter(5.0, "s that the gripper may take")
    arrival_tolerance: float = parameter(0.1, "rad that a joint may be off after a motion")

    @property
    def limits(self) -> Limits:
        """What the arm may do.

        Raises:
            InvalidParameterError: An unknown arm, or a speed or workspace that there is not.
        """
        return arm_limits(self.arm).scaled(self.speed, self.space)


@dataclass(frozen=True)
class BridgeParameters(WorldParameters):
    """The domain that runs on a robot, and how long a bridge to it waits."""

    detection_timeout: float = parameter(2.0, "s without a measured state until the robot holds")
    hold_after: float = parameter(0.5, "s without a command after which it says that it holds")

    @property
    def choice(self) -> DomainChoice:
        """The domain that runs, whose states are measured."""
        return replace(super().choice, measured=True)


@dataclass(frozen=True)
class RobotBridgeParameters(PointToPointParameters, BridgeParameters):
    """Those of the bridge that waits for each motion: see the docstring of its node."""

    domain: str = parameter("obstacle_tower", "which domain")
    preset: str = parameter("", "one that obeys the joints' speed limit")
    horizon: int = parameter(
        1, "commands that the arm executes without a stop between them, at most", low=1, high=8
    )
    settle_time: float = parameter(1.5, "s to wait for what moves to come to rest")

    @property
    def motion_limits(self) -> MotionLimits:
        """What a motion through several steps keeps to: of a Panda as of an FR3.

        Raises:
            InvalidParameterError: As ``limits``.
        """
        limits = franka_limits(self.limits, self.speed)
        return MotionLimits.of(limits, tuple(self.speed * jerk for jerk in JERK))


@dataclass(frozen=True)
class ServoBridgeParameters(RobotParameters, BridgeParameters):
    """Those of a bridge at a bench: see the docstring of ``robot_bridge.servo.node``."""

    domain: str = parameter("stack_at_target", "which domain")
    workspace: tuple[float, ...] = with_default(RobotParameters, "workspace", BENCH)
    position_noise: float = with_default(RobotParameters, "position_noise", 0.0005)
    turn_noise: float = with_default(RobotParameters, "turn_noise", 0.005)
    trajectory_topic: str = parameter(TRAJECTORY_TOPIC, "topic of the arm's controller")
    pace: float = parameter(
        1.0, "how many times faster than a real robot's its time passes", low=0.01, high=1e3
    )


@dataclass(frozen=True)
class PlayerParameters(PointToPointParameters):
    """Those of a robot, and how far from where the recording begins things may be."""

    start_timeout: float = parameter(15.0, "s to wait for the robot and every object")
    start_tolerance: float = parameter(0.05, "rad that a joint may be off the recording's start")
    place_tolerance: float = parameter(0.01, "m that an object may be off the recording's start")


@dataclass(frozen=True)
class SimulatedRobotParameters(WorldParameters):
    """What every simulated robot has: a task to begin with, interfaces, noise and pace."""

    domain: str = parameter("obstacle_tower", "which domain")
    preset: str = parameter("", "as the bridge's")
    seed: int = parameter(0, "samples the task", high=MAX_SEED)
    arm: str = parameter("panda", "prefix of joints and frames")
    trajectory_action: str = parameter(TRAJECTORY_ACTION, "the arm's controller")
    gripper_action: str = parameter(GRIPPER_ACTION, "the gripper's controller")
    gripper_scale: float = parameter(0.5, "position that is sent per m between the fingers")
    latency: float = parameter(0.02, "s, of goals and detections")
    jitter: float = parameter(0.0, "s, at most, on top of the latency")
    pose_noise: float = parameter(0.002, "m, of detections along each axis")
    turn_noise: float = parameter(0.01, "rad, of detections about each axis")
    joint_noise: float = parameter(0.0, "rad, of joint positions")
    dropout: float = parameter(0.0, "share of detections that are lost")
    rate: float = parameter(30.0, "Hz, of detections", low=0.1, high=1e3)
    joint_rate: float = parameter(100.0, "Hz, of joint positions", low=0.1, high=1e3)
    hidden: str = parameter("", "an object that is never detected")
    pace: float = parameter(
        1.0, "how many times faster than a real one it moves", low=0.01, high=1e3
    )
    noise_seed: int = parameter(0, "noise and delays are a function of it", high=MAX_SEED)


@dataclass(frozen=True)
class MockRobotParameters(SimulatedRobotParameters):
    """What a mock robot is: see the docstring of ``robot_bridge.mock.node``."""

    fault: str = parameter("", "reject, abort, ignore or stand: what is done to a motion")
    fault_after: int = parameter(0, "and after how many good ones")


@dataclass(frozen=True)
class MujocoRobotParameters(CameraParameters, SimulatedRobotParameters):
    """What a robot in MuJoCo is: see the docstring of ``robot_bridge.mujoco.node``."""

    pose_noise: float = with_default(SimulatedRobotParameters, "pose_noise", 0.0)
    turn_noise: float = with_default(SimulatedRobotParameters, "turn_noise", 0.0)
    path_tolerance: float = parameter(0.2, "rad, by which a joint may be off its path; 0: any")
    goal_tolerance: float = parameter(0.05, "rad, by which a joint may be off at the end; 0: any")
    stopped_velocity: float = parameter(0.01, "rad/s, of a joint that stands; 0: any")
    goal_time: float = parameter(1.0, "s, by which the arm may arrive late; 0: any time")
    trajectory_topic: str = parameter(
        TRAJECTORY_TOPIC, "topic of trajectories that replace one another"
    )
    impedance: float = parameter(0.0, "N/m that pull the hand; 0: its joints are pulled", high=1e5)
    stiffness: float = parameter(1.0, "of the arm's joints, as a factor", low=0.01, high=1e3)
    lag: float = parameter(0.07, "s, by which a joint in motion is late", low=0.001, high=10.0)


@dataclass(frozen=True)
class FrankaConnectionParameters:
    """How a Franka arm is reached, and where its control stops it."""

    ip: str = parameter("", "address of the robot")
    collision_torque: float = parameter(COLLISION_TORQUE, "Nm about a joint: a collision", high=87)
    collision_force: float = parameter(COLLISION_FORCE, "N on the hand: a collision", high=150)
    realtime: bool = parameter(True, "whether a real-time kernel is demanded")


@dataclass(frozen=True)
class FrankaBridgeParameters(FrankaConnectionParameters, RobotBridgeParameters):
    """Those of robot_bridge in front of a Franka arm, and of the arm's driver."""

    arm: str = parameter("fr3", "fr3")


@dataclass(frozen=True)
class FrankaPlayerParameters(FrankaConnectionParameters, PlayerParameters):
    """Those of a replay on a Franka arm, and of the arm's driver."""

    arm: str = parameter("fr3", "fr3")

    @property
    def limits(self) -> Limits:
        """What the arm may do when it is driven by its own protocol; see the base class."""
        return franka_limits(super().limits, self.speed)


@dataclass(frozen=True)
class FrankaDriverParameters(FrankaConnectionParameters, SimulatedRobotParameters):
    """How a Franka arm is driven: see the docstring of ``robot_bridge.franka.node``."""

    simulated: bool = parameter(False, "whether to start a simulated FR3")
    arm: str = parameter("fr3", "prefix of joints and frames")
    speed: float = parameter(1.0, "fraction of the limits of velocity, acceleration and jerk")
    goal_tolerance: float = parameter(0.05, "rad, by which a joint may be off at the end")
    clients: str = parameter("robot_bridge robot_player", "nodes without which the arm holds")
    pose_noise: float = with_default(SimulatedRobotParameters, "pose_noise", 0.0)
    turn_noise: float = with_default(SimulatedRobotParameters, "turn_noise", 0.0)

    @property
    def franka(self) -> FrankaSettings:
        """What the arm is connected by.

        Raises:
            InvalidParameterError: A speed that there is not.
        """
        limits = franka_limits(FR3.scaled(self.speed, Workspace()), self.speed)
        return FrankaSettings(
            self.ip,
            limits,
            self.speed,
            self.collision_torque,
            self.collision_force,
            self.realtime,
        )


CONNECTION = frozenset(item.name for item in fields(FrankaConnectionParameters))
TOLD_THE_DRIVER = CONNECTION | {
    "arm",
    "speed",
    "trajectory_action",
    "gripper_action",
    "gripper_scale",
}


def parse_mock_robot(text: str) -> dict[str, str | int | float]:
    """The mock robot's parameters as a command line has them: ``latency=0.05,dropout=0.1``.

    Returns:
        Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    return parse_parameters(text, MockRobotParameters, "mock robot", GIVEN_WITH_THE_RUN)


def parse_mujoco_robot(text: str) -> dict[str, str | int | float]:
    """The parameters of a robot in MuJoCo as a command line has them: ``pace=5,dropout=0.1``.

    Returns:
        Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    return parse_parameters(text, MujocoRobotParameters, "MuJoCo robot", GIVEN_WITH_THE_RUN)


def parse_franka(text: str) -> tuple[Parameters, Parameters]:
    """The parameters of a Franka arm as a command line has them: ``ip=172.16.0.2,speed=0.1``.

    Returns:
        Parameters of the bridge, and those of the driver, by name.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    given = GIVEN_WITH_THE_RUN - {"scene"}
    found = parse_parameters(text, FrankaBridgeParameters, "robot", given)
    return franka_parts(found)


def franka_parts(found: Parameters) -> tuple[Parameters, Parameters]:
    """Parameters by name as those of whoever sends goals, and those of the arm's driver."""
    driver = {name: value for name, value in found.items() if name in TOLD_THE_DRIVER}
    own = {name: value for name, value in found.items() if name not in CONNECTION}
    return own, driver


def parse_robot_bridge(text: str) -> dict[str, str | int | float | tuple[float, ...]]:
    """The bridge's parameters as a command line has them: ``speed=0.1,arm=fr3``.

    Returns:
        Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    return parse_parameters(text, RobotBridgeParameters, "robot", GIVEN_WITH_THE_RUN)


def parse_servo_bridge(text: str) -> dict[str, str | int | float | tuple[float, ...]]:
    """The parameters of the bridge at a bench as a command line has them: ``gripper_effort=40``.

    Returns:
        Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: An unknown parameter, or a value that it cannot have.
    """
    return parse_parameters(text, ServoBridgeParameters, "robot", GIVEN_WITH_THE_RUN | {"pace"})
