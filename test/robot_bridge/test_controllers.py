# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What controllers answer, as drivers do: what counts as done, and what is said of the rest."""

from contextlib import contextmanager, suppress

import pytest
from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from sensor_msgs.msg import JointState

from ensemble.interfaces import JOINT_STATES
from ensemble.parameters import read_parameters
from ensemble.robot_parameters import (
    RobotBridgeParameters,
    action_name,
    arm_joints,
    finger_joints,
)
from ensemble.spinner import temporary_node
from robot_bridge.robot import Robot
from robot_bridge.simulated.waiting import pause
from slap_ros.domains import get_domain
from slap_ros.errors import ControllerAbortedError
from slap_ros.robot.gripper import GAP_OPEN, GAP_SHUT
from slap_ros.robot.joint_trajectory import TrajectoryPoint

LIMIT = 60.0  # s, far more than anything here takes
HELD = 0.04  # m, a block between the fingers


class Driver:
    """Controllers that end every goal in one way, with fingers that stand where they are told."""

    def __init__(self, node, settings):
        self.node, self.end, self.result, self.gap = node, "succeed", {}, GAP_OPEN
        self.accept = lambda _: GoalResponse.ACCEPT
        self._states = node.create_publisher(JointState, JOINT_STATES.name, JOINT_STATES.qos)
        self._names = [*arm_joints(settings.arm), *finger_joints(settings.arm)]
        self._servers = [
            ActionServer(
                node,
                kind,
                action_name(name, settings.arm),
                answer,
                goal_callback=lambda goal: self.accept(goal),
                cancel_callback=lambda _: CancelResponse.ACCEPT,
            )
            for kind, name, answer in (
                (FollowJointTrajectory, settings.trajectory_action, self._move),
                (GripperCommand, settings.gripper_action, self._grip),
            )
        ]
        node.create_timer(0.01, self._tell)

    def destroy(self):
        for server in self._servers:
            server.destroy()

    def _tell(self):
        message = JointState(name=self._names, position=[0.0] * 7 + [self.gap / 2] * 2)
        message.header.stamp = self.node.get_clock().now().to_msg()
        self._states.publish(message)

    async def _move(self, goal):
        return await self._ended(goal, FollowJointTrajectory.Result(**self.result))

    async def _grip(self, goal):
        return await self._ended(goal, GripperCommand.Result(**self.result))

    async def _ended(self, goal, result):
        getattr(goal, self.end)()
        return result


@contextmanager
def driven():
    """A robot, and whoever drives it."""
    with temporary_node(lambda: Node("bridge")) as (node, spinner):
        settings = read_parameters(node, RobotBridgeParameters)
        domain = get_domain("obstacle_tower")
        robot = Robot(node, domain, lambda: domain.task(0).initial_state, settings)
        driver = Driver(node, settings)
        try:
            assert spinner.spin_until(lambda: robot.controllers.ready, LIMIT)
            yield robot, driver, spinner
        finally:
            robot.destroy()
            driver.destroy()


def outcome(spinner, work):
    task = spinner.executor.create_task(work)
    with suppress(ControllerAbortedError):  # the executor raises it as well
        spinner.spin_until(task.done, LIMIT)
    return task.result() if task.exception() is None else task.exception()


ENDINGS = [  # how the goal ends, whether fingers stall, what is asked for, where they stand
    pytest.param("succeed", True, GAP_SHUT, HELD, True, id="around a block"),
    pytest.param("succeed", False, GAP_SHUT, 0.0, True, id="around nothing"),
    pytest.param("abort", True, GAP_SHUT, HELD, True, id="stalled around a block"),
    pytest.param("abort", True, GAP_SHUT, 0.0, False, id="stalled around nothing"),
    pytest.param("abort", True, GAP_OPEN, 0.01, False, id="stalled on the way open"),
    pytest.param("abort", False, GAP_SHUT, HELD, False, id="given up"),
]


def test_fingers_that_stall_count_only_if_they_hold_something(network):
    with driven() as (robot, driver, spinner):
        for ending in ENDINGS:
            end, stalled, wanted, driver.gap, done = ending.values
            driver.end, driver.result = end, {"stalled": stalled}
            found = outcome(spinner, robot.move_fingers(wanted))
            if done:
                assert found == pytest.approx(driver.gap), ending.id
            else:
                assert isinstance(found, ControllerAbortedError), ending.id


def test_a_canceled_grip_is_none_whatever_the_fingers_hold(network):
    with driven() as (robot, driver, spinner):
        driver.gap, driver.result = HELD, {"stalled": True}

        async def canceled(goal, result):
            while not goal.is_cancel_requested:
                robot.controllers.hold()  # as a fault does meanwhile
                await pause(driver.node, 0.01)
            goal.canceled()
            return result

        driver._ended = canceled
        found = outcome(spinner, robot.move_fingers(GAP_SHUT))
        assert isinstance(found, ControllerAbortedError)
        assert "franka_gripper/gripper_action canceled a goal" in str(found)


def test_a_motion_that_is_to_be_held_before_it_is_accepted_is_canceled(network):
    with driven() as (robot, driver, spinner):

        def accept(_):
            robot.controllers.hold()  # as a fault does meanwhile
            return GoalResponse.ACCEPT

        async def canceled(goal, result):
            for _ in range(100):
                if goal.is_cancel_requested:
                    goal.canceled()
                    return result
                await pause(driver.node, 0.01)
            goal.succeed()
            return result

        driver.accept, driver._ended = accept, canceled
        found = outcome(spinner, robot.controllers.follow([TrajectoryPoint(0.1, (0.01,) * 7)]))
        assert isinstance(found, ControllerAbortedError)
        assert "follow_joint_trajectory canceled a motion" in str(found)


@pytest.mark.parametrize(
    ("code", "words"),
    [(-4, "PATH_TOLERANCE_VIOLATED, blocked"), (-77, "unknown code -77, blocked")],
)
def test_a_trajectory_that_is_given_up_has_its_reason_by_name(network, code, words):
    with driven() as (robot, driver, spinner):
        driver.end, driver.result = "abort", {"error_code": code, "error_string": "blocked"}
        points = [TrajectoryPoint(0.1, (0.01,) * 7)]
        found = outcome(spinner, robot.controllers.follow(points))
        assert f"follow_joint_trajectory gave up a motion: {words}" in str(found)
