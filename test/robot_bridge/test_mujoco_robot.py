# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo as a node: what its controllers answer, as drivers do."""

import math
from contextlib import contextmanager

import pytest
from builtin_interfaces.msg import Duration, Time
from control_msgs.action import FollowJointTrajectory, GripperCommand
from control_msgs.msg import JointTolerance
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ensemble.cli.run_options import RunOptions
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.robot_parameters import arm_joints, parse_mujoco_robot, parse_robot_bridge
from ensemble.spinner import temporary_node
from slap_ros.errors import InvalidParameterError
from slap_ros.skills.domain_choice import DomainChoice
from support.controller_bench import ControllerBench

pytest.importorskip("mujoco")

JOINTS = arm_joints("panda")


@pytest.fixture(scope="module")
def laboratory(module_network):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(module_network))
        with made() as lab:
            yield lab


@contextmanager
def made():
    choice = DomainChoice("obstacle_tower", "fair")
    nodes = node_parameters(
        RunSettings(choice, 1, 0, "lazy", None, world="mujoco", mujoco={"pace": 20.0})
    )
    with (
        temporary_node(lambda: Node("laboratory")) as (node, spinner),
        InProcessLauncher({"robot_bridge.mujoco": nodes["robot_bridge.mujoco"]}, spinner.executor),
    ):
        lab = ControllerBench(node, spinner, "panda")
        yield lab
        lab.destroy()


def motion(target, seconds=0.5, names=JOINTS, stamp_s=0, **tolerances):
    point = JointTrajectoryPoint(
        positions=list(target),
        velocities=[0.0] * len(target),
        time_from_start=Duration(sec=int(seconds), nanosec=int(seconds % 1 * 1e9)),
    )
    trajectory = JointTrajectory(joint_names=list(names), points=[point])
    trajectory.header.stamp = Time(sec=stamp_s)
    return FollowJointTrajectory.Goal(trajectory=trajectory, **tolerances)


def turned(joints, angle, joint=0):
    return [q + angle * (i == joint) for i, q in enumerate(joints)]


def test_a_motion_ends_where_it_was_to_end_whatever_the_order_of_its_joints(laboratory):
    target = turned(laboratory.at(), 0.2)
    goal = motion(target[::-1], names=JOINTS[::-1])
    handle = laboratory.sent(laboratory.arm, goal)
    assert handle.accepted
    result = laboratory.ended(handle)
    assert result.error_code == FollowJointTrajectory.Result.SUCCESSFUL
    laboratory.until(lambda: math.dist(laboratory.at(), target) < 0.01)


@pytest.mark.parametrize("wrong", ["partial", "unknown", "past", "empty"])
def test_goals_that_a_driver_refuses_move_nothing(laboratory, wrong):
    before = laboratory.at()
    goal = {
        "partial": lambda: motion(before[:6], names=JOINTS[:6]),
        "unknown": lambda: motion(before, names=[*JOINTS[:6], "elbow"]),
        "past": lambda: motion(turned(before, 0.2), stamp_s=1),
        "empty": FollowJointTrajectory.Goal,
    }[wrong]()
    assert not laboratory.sent(laboratory.arm, goal).accepted
    assert math.dist(laboratory.at(), before) < 0.01


def test_an_arm_that_cannot_follow_is_given_up_by_what_the_goal_allows(laboratory):
    before = laboratory.at()
    tight = [JointTolerance(name=name, position=1e-4) for name in JOINTS]
    goal = motion(turned(before, 0.5), 0.3, path_tolerance=tight)
    result = laboratory.ended(laboratory.sent(laboratory.arm, goal))
    assert result.error_code == FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
    assert "off the path" in result.error_string
    below = turned(before, 0.9, joint=1)  # with its hand in the table
    goal = motion(
        below, 3.0, path_tolerance=[JointTolerance(name=n, position=-1.0) for n in JOINTS]
    )
    result = laboratory.ended(laboratory.sent(laboratory.arm, goal))
    assert result.error_code == FollowJointTrajectory.Result.GOAL_TOLERANCE_VIOLATED
    handle = laboratory.sent(laboratory.arm, motion(before, 3.0))
    assert laboratory.ended(handle).error_code == FollowJointTrajectory.Result.SUCCESSFUL


def test_a_motion_that_is_canceled_stops_where_it_is(laboratory):
    before = laboratory.at()
    target = turned(before, 1.0)
    handle = laboratory.sent(laboratory.arm, motion(target, 40.0))
    laboratory.until(lambda: math.dist(laboratory.at(), before) > 0.01)
    laboratory.result(handle.cancel_goal_async())
    laboratory.ended(handle)
    assert math.dist(laboratory.at(), target) > 0.3


def test_another_motion_takes_the_place_of_the_one_under_way(laboratory):
    before = laboratory.at()
    first = laboratory.sent(laboratory.arm, motion(turned(before, 1.0), 40.0))
    second = laboratory.sent(laboratory.arm, motion(turned(before, 0.1), 0.5))
    assert laboratory.ended(first).error_code == FollowJointTrajectory.Result.INVALID_GOAL
    assert laboratory.ended(second).error_code == FollowJointTrajectory.Result.SUCCESSFUL


def test_fingers_that_meet_nothing_reach_their_goal(laboratory):
    for position in (0.0, 0.04):
        goal = GripperCommand.Goal()
        goal.command.position, goal.command.max_effort = position, 20.0
        result = laboratory.ended(laboratory.sent(laboratory.gripper, goal))
        assert result.reached_goal
        assert not result.stalled
        assert result.position == pytest.approx(position, abs=2e-3)


def test_parameters_on_the_command_line():
    assert parse_mujoco_robot("pace=5,goal_tolerance=0.02") == {"pace": 5.0, "goal_tolerance": 0.02}
    with pytest.raises(InvalidParameterError, match="no parameter 'fault'"):
        parse_mujoco_robot("fault=abort")
    assert parse_robot_bridge("speed=1.0")["speed"] == 1.0
    with pytest.raises(InvalidParameterError, match="--mujoco is for --world mujoco"):
        RunOptions("obstacle_tower", world="mock", mujoco="pace=2")
    with pytest.raises(InvalidParameterError, match="--robot is for a robot"):
        RunOptions("obstacle_tower", robot="speed=1.0")
