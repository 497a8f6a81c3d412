# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The action servers of a robot's controllers. Every goal can be canceled."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from ensemble.robot_parameters import SimulatedRobotParameters, action_name

Execute = Callable[[ServerGoalHandle], Awaitable[Any]]
Accept = Callable[[Any], GoalResponse]


def arm_server(
    node: Node, settings: SimulatedRobotParameters, execute: Execute, accept: Accept
) -> ActionServer:
    """The server of an arm's trajectories.

    Args:
        node: Node that has the server.
        settings: Parameters of the robot, with the name of the action.
        execute: What carries out a goal and gives its result.
        accept: What accepts or rejects a goal.
    """
    name = action_name(settings.trajectory_action, settings.arm)
    return _server(node, FollowJointTrajectory, name, execute, accept)


def gripper_server(
    node: Node, settings: SimulatedRobotParameters, execute: Execute, accept: Accept
) -> ActionServer:
    """The server of a gripper's motions.

    Args:
        node: Node that has the server.
        settings: Parameters of the robot, with the name of the action.
        execute: What carries out a goal and gives its result.
        accept: What accepts or rejects a goal.
    """
    name = action_name(settings.gripper_action, settings.arm)
    return _server(node, GripperCommand, name, execute, accept)


def _server(node: Node, action: Any, name: str, execute: Execute, accept: Accept) -> ActionServer:
    return ActionServer(
        node,
        action,
        name,
        execute,
        goal_callback=accept,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )
