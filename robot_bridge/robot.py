# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot as a node moves it: the cell it stands in, its senses and its controllers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node
from rclpy.task import Future

from ensemble.parameters import parameter
from ensemble.waiting import first_of, seconds
from robot_bridge.controllers import (
    GRIPPER_ACTION,
    TRAJECTORY_ACTION,
    Controllers,
    action_name,
)
from robot_bridge.senses import Senses
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, NoJointStateError
from slap_ros.relational import State
from slap_ros.robot.cell import Cell
from slap_ros.robot.limits import Limits, Workspace, arm_limits
from slap_ros.robot.tracking import Sensing
from slap_ros.robot.workplace import read_workplace, sampled_workplace

WORKSPACE = (*Workspace().low, *Workspace().high)
GAP_AGE = 0.1  # s, by which told finger positions may be older than their stamp: drivers merge them


@dataclass(frozen=True)
class RobotParameters:
    """What a robot is: see the docstring of ``robot_bridge.node``."""

    scene: str = parameter("", "a scene file; empty: the sampled task's objects")
    arm: str = parameter("panda", "panda or fr3")
    speed: float = parameter(0.5, "fraction of the velocity and acceleration limits")
    workspace: tuple[float, ...] = parameter(WORKSPACE, "m, fingertips, lowest x y z, highest")
    trajectory_action: str = parameter(TRAJECTORY_ACTION, "the arm's controller")
    gripper_action: str = parameter(GRIPPER_ACTION, "the gripper's controller")
    gripper_scale: float = parameter(0.5, "position to be sent for each m between the fingers")
    gripper_effort: float = parameter(20.0, "N")
    position_noise: float = parameter(0.002, "m, of detections, along each axis")
    turn_noise: float = parameter(0.01, "rad, of detections, about each axis")
    joint_timeout: float = parameter(0.5, "s without joint positions until the robot holds")
    controller_timeout: float = parameter(0.5, "s that a controller may take longer than it should")
    gripper_timeout: float = parameter(5.0, "s that the gripper may take")
    arrival_tolerance: float = parameter(0.1, "rad that a joint may be off after a motion")

    @property
    def limits(self) -> Limits:
        """What the arm may do.

        Raises:
            InvalidParameterError: An unknown arm, or a speed or workspace that there is not.
        """
        if len(self.workspace) != len(WORKSPACE):
            raise InvalidParameterError(
                "parameter workspace is x y z at its lowest and at its highest"
            )
        x, y, z, to_x, to_y, to_z = self.workspace
        return arm_limits(self.arm).scaled(self.speed, Workspace((x, y, z), (to_x, to_y, to_z)))

    @property
    def sensing(self) -> Sensing:
        """How well detections can be trusted."""
        return Sensing(self.position_noise, self.turn_noise)


class Robot:
    """What a node knows of a robot, and has it do."""

    def __init__(
        self, node: Node, domain: Domain, sampled: Callable[[], State], settings: RobotParameters
    ) -> None:
        """Listen to it and look for its controllers.

        Args:
            node: The node that does.
            domain: What the robot is to do.
            sampled: The state whose objects there are, where no scene says which.
            settings: Of the robot.

        Raises:
            InvalidParameterError: An unknown arm, or a speed or workspace that there is not.
            InvalidSceneError: The scene file is missing or malformed.
        """
        self._node, self._settings = node, settings
        workplace = (
            read_workplace(Path(settings.scene), domain)
            if settings.scene
            else sampled_workplace(sampled())
        )
        self.cell = Cell(domain, workplace, settings.limits, settings.sensing)
        self.senses = Senses(node, self.cell, settings.arm, f"{settings.arm}_link0")
        self.controllers = Controllers(
            node,
            action_name(settings.trajectory_action, settings.arm),
            action_name(settings.gripper_action, settings.arm),
            self.senses.joints,
            settings.controller_timeout,
        )

    def destroy(self) -> None:
        """Hold, and give back what is held."""
        self.controllers.hold()
        self.controllers.destroy()
        self.cell.close()

    async def move_fingers(self, gap: float) -> float:
        """Move the fingers to ``gap`` m, or until they stall; the gap in m at which they stand.

        Raises:
            ControllerRejectedError, ControllerAbortedError, ControllerTimeoutError: Of the gripper.
            NoJointStateError: Nobody says where they are.
        """
        settings, senses = self._settings, self.senses
        await self.controllers.grip(
            gap * settings.gripper_scale, settings.gripper_effort, settings.gripper_timeout
        )
        done_s = seconds(self._node) + GAP_AGE
        late_s = done_s + settings.joint_timeout
        await first_of(
            self._node,
            Future(),
            lambda: senses.gap_s > done_s or seconds(self._node) > late_s,
        )
        if senses.gap is None or senses.gap_s <= done_s:
            raise NoJointStateError(
                f"no positions of the fingers within {settings.joint_timeout} s: are they among "
                "joint_states?"
            )
        return senses.gap
