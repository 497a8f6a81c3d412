# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver of a Franka arm as a node, with a simulated FR3: what its controllers answer."""

import math
import os

import pytest
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory, GripperCommand
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ensemble.interfaces import SENSOR_DATA, TF
from ensemble.robot_parameters import arm_joints
from ensemble.spinner import temporary_node
from slap_ros.errors import ErrorCode, InvalidParameterError
from support.controller_bench import ControllerBench

NO_WHEEL = "franky-control and franky-sim are not installed: pip install 'slap_ros[franka-sim]'"
JOINTS = arm_joints("fr3")

pytest.importorskip("franky", reason=NO_WHEEL)
if "SLAP_FRANKA_SIM_PYTHON" not in os.environ:
    pytest.importorskip("franky_sim", reason=NO_WHEEL)


class FrankaLaboratory(ControllerBench):
    """The driver, and clients of its controllers."""

    def __init__(self, node, spinner, driver):
        super().__init__(node, spinner, "fr3")
        self.driver, self.frames = driver, set()
        self.recovery = node.create_client(Trigger, "franka_driver/recover")
        node.create_subscription(TFMessage, TF.name, self._see, SENSOR_DATA)

    def _see(self, message):
        self.frames |= {item.child_frame_id for item in message.transforms}

    def recover(self):
        return self.result(self.recovery.call_async(Trigger.Request())).success


@pytest.fixture(scope="module")
def laboratory(module_network):
    from robot_bridge.franka.node import FrankaDriver

    overrides = [Parameter("simulated", value=True), Parameter("realtime", value=False)]
    overrides.append(Parameter("clients", value="visitor"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(module_network))
        with temporary_node(lambda: Node("laboratory")) as (node, spinner):
            driver = FrankaDriver(parameter_overrides=overrides)
            spinner.executor.add_node(driver)
            lab = FrankaLaboratory(node, spinner, driver)
            yield lab
            lab.destroy()
            spinner.executor.remove_node(driver)
            driver.destroy_node()


def motion(start, angle, points=2, seconds=0.5, names=JOINTS):
    """A motion of the first joint by an angle, with a velocity on the way."""
    found = []
    for k in range(1, points + 1):
        time_s = seconds * k / points
        found.append(
            JointTrajectoryPoint(
                positions=[q + angle * k / points * (i == 0) for i, q in enumerate(start)],
                velocities=[angle / seconds * (i == 0 and k < points) for i in range(7)],
                time_from_start=Duration(sec=int(time_s), nanosec=int(time_s % 1 * 1e9)),
            )
        )
    trajectory = JointTrajectory(joint_names=list(names), points=found)
    return FollowJointTrajectory.Goal(trajectory=trajectory)


def test_a_motion_through_points_ends_at_the_last_and_frames_are_published(laboratory):
    start = laboratory.at()
    result = laboratory.ended(laboratory.sent(laboratory.arm, motion(start, 0.2)))
    assert result.error_code == FollowJointTrajectory.Result.SUCCESSFUL
    laboratory.until(lambda: abs(laboratory.at()[0] - start[0] - 0.2) < 0.01)
    laboratory.until(lambda: {"fr3_hand", "detected_block1"} <= laboratory.frames)


def test_goals_that_a_driver_refuses_move_nothing(laboratory):
    before = laboratory.at()
    for wrong in (
        motion(before[:6], 0.1, names=JOINTS[:6]),
        motion(before, 9.0),
        FollowJointTrajectory.Goal(),
    ):
        assert not laboratory.sent(laboratory.arm, wrong).accepted
    assert math.dist(laboratory.at(), before) < 0.01


@pytest.mark.slow  # the arm without its node shows the same
def test_a_motion_that_is_canceled_stops_where_it_is(laboratory):
    start = laboratory.at()
    handle = laboratory.sent(laboratory.arm, motion(start, -0.9, seconds=3.0))
    laboratory.until(lambda: abs(laboratory.at()[0] - start[0]) > 0.05)
    laboratory.result(handle.cancel_goal_async())
    laboratory.ended(handle)
    assert abs(laboratory.at()[0] - start[0] + 0.9) > 0.2


def test_an_arm_holds_when_whoever_sends_goals_is_gone(laboratory):
    visitor = Node("visitor")
    laboratory.until(lambda: laboratory.driver._clients == {"visitor"})
    start = laboratory.at()
    handle = laboratory.sent(laboratory.arm, motion(start, 1.0, points=20, seconds=8.0))
    laboratory.until(lambda: abs(laboratory.at()[0] - start[0]) > 0.02)
    visitor.destroy_node()
    laboratory.ended(handle)
    assert abs(laboratory.at()[0] - start[0]) < 0.9


def test_a_reflex_has_its_code_and_only_a_person_lets_the_arm_move_again(laboratory):
    start = laboratory.at()
    handle = laboratory.sent(laboratory.arm, motion(start, 0.8, seconds=2.0))
    laboratory.until(lambda: abs(laboratory.at()[0] - start[0]) > 0.02)
    laboratory.driver._simulation.inject("reflex")
    result = laboratory.ended(handle)
    assert result.error_code == ErrorCode.ROBOT_REFLEX
    assert result.error_string
    there = laboratory.at()
    assert not laboratory.sent(laboratory.arm, motion(there, 0.1)).accepted
    assert not laboratory.sent(laboratory.gripper, GripperCommand.Goal()).accepted
    assert math.dist(laboratory.at(), there) < 0.02
    assert laboratory.recover()
    result = laboratory.ended(laboratory.sent(laboratory.arm, motion(laboratory.at(), 0.05)))
    assert result.error_code == FollowJointTrajectory.Result.SUCCESSFUL


@pytest.mark.slow  # the arm without its node shows the same
def test_fingers_that_meet_nothing_reach_their_goal(laboratory):
    goal = GripperCommand.Goal()
    goal.command.position, goal.command.max_effort = 0.01, 20.0
    result = laboratory.ended(laboratory.sent(laboratory.gripper, goal))
    assert result.reached_goal
    assert result.position == pytest.approx(0.01, abs=2e-3)


@pytest.mark.parametrize("wrong", [{}, {"ip": "127.78.0.4", "simulated": True}])
def test_either_an_address_or_a_simulation(laboratory, wrong):
    from robot_bridge.franka.node import FrankaDriver

    overrides = [Parameter(name, value=value) for name, value in wrong.items()]
    with pytest.raises(InvalidParameterError, match="address of a robot"):
        FrankaDriver(parameter_overrides=overrides)
