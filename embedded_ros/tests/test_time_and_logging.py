# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Clocks, simulated time, and logging."""

from __future__ import annotations

import re
import time

import pytest
import rclpy
from rcl_interfaces.msg import Log
from rclpy.clock import Clock, ClockType, ROSClock
from rclpy.duration import Duration, Infinite
from rclpy.logging import LoggingSeverity, get_logger, get_logger_effective_level
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_rosout_default
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage

from conftest import spin_until


def test_times_and_durations() -> None:
    start = Time(seconds=1, nanoseconds=500_000_000)
    assert start + Duration(seconds=0.5) == Time(seconds=2)
    assert Time(seconds=2) - start == Duration(seconds=0.5)
    assert (start - Duration(seconds=1)).nanoseconds == 500_000_000
    assert start.seconds_nanoseconds() == (1, 500_000_000)
    assert start < Time(seconds=2)
    message = start.to_msg()
    assert (message.sec, message.nanosec) == (1, 500_000_000)
    assert Time.from_msg(message, ClockType.SYSTEM_TIME) == start
    negative = Duration(seconds=-1.5)
    assert Duration.from_msg(negative.to_msg()) == negative
    assert Infinite > Duration(seconds=1e9)
    with pytest.raises(TypeError, match="different clock types"):
        _ = start < Time(seconds=2, clock_type=ClockType.ROS_TIME)
    with pytest.raises(ValueError, match="must not be negative"):
        Time(seconds=-1)
    with pytest.raises(TypeError):
        Time.from_msg(negative.to_msg())


def test_clocks() -> None:
    system, steady = Clock(), Clock(clock_type=ClockType.STEADY_TIME)
    assert time.time_ns() <= system.now().nanoseconds <= time.time_ns()
    assert steady.now() <= steady.now()
    assert Clock(clock_type=ClockType.ROS_TIME).ros_time_is_active is False
    with pytest.raises(NotImplementedError, match="jump callbacks"):
        system.create_jump_callback(None)


def test_simulated_time_drives_clock_and_timers(context: None) -> None:
    simulation = Node("simulation")
    clock = simulation.create_publisher(ClockMessage, "/clock", 10)
    override = [Parameter("use_sim_time", value=True)]
    node = Node("simulated", parameter_overrides=override)
    calls: list[int] = []
    node.create_timer(1.0, lambda: calls.append(node.get_clock().now().nanoseconds))
    assert node.get_clock().now().nanoseconds == 0

    def tick(seconds: float, calls_since_the_beginning: int) -> None:
        clock.publish(ClockMessage(clock=Time(seconds=seconds).to_msg()))
        assert spin_until(node, lambda: node.get_clock().now() == ros_time(seconds))
        assert spin_until(node, lambda: len(calls) >= calls_since_the_beginning)
        spin_until(node, lambda: False, 0.03)
        assert len(calls) == calls_since_the_beginning

    tick(0.5, 0)
    time.sleep(0.1)
    tick(1.5, 1)
    assert calls == [1_500_000_000]
    tick(1.9, 1)
    tick(2.0, 2)
    tick(0.5, 2)  # began again
    tick(1.5, 3)
    node.set_parameters([Parameter("use_sim_time", value=False)])
    assert time.time_ns() <= node.get_clock().now().nanoseconds <= time.time_ns()
    assert not node.set_parameters([Parameter("use_sim_time", value="yes")])[0].successful
    simulation.destroy_node()
    node.destroy_node()


def ros_time(seconds: float) -> Time:
    return Time(seconds=seconds, clock_type=ClockType.ROS_TIME)


def test_the_console_format(node: Node, capfd: pytest.CaptureFixture[str]) -> None:
    node.get_logger().info("hello")
    node.get_logger().get_child("part").error("world")
    node.get_logger().debug("unseen")
    lines = capfd.readouterr().err.splitlines()
    assert re.fullmatch(r"\[INFO\] \[\d+\.\d{9}\] \[tester\]: hello", lines[0])
    assert re.fullmatch(r"\[ERROR\] \[\d+\.\d{9}\] \[tester\.part\]: world", lines[1])
    assert len(lines) == 2


def test_levels() -> None:
    rclpy.logging.clear_config()
    parent, child = get_logger("arm"), get_logger("arm.wrist")
    assert child.get_effective_level() == LoggingSeverity.INFO
    parent.set_level(LoggingSeverity.ERROR)
    assert child.get_effective_level() == LoggingSeverity.ERROR
    child.set_level(LoggingSeverity.DEBUG)
    assert child.is_enabled_for(LoggingSeverity.DEBUG)
    assert not parent.is_enabled_for(LoggingSeverity.WARN)
    assert get_logger_effective_level("other") == LoggingSeverity.INFO
    rclpy.logging.clear_config()


def test_filters() -> None:
    logger = get_logger("filters")
    assert [logger.info("once", once=True) for _ in range(3)] == [True, False, False]
    assert [logger.info("skip", skip_first=True) for _ in range(3)] == [False, True, True]
    clock = ROSClock()
    logged = []
    for tenths in (10, 16, 20, 29, 30):
        clock.set_ros_time_override(ros_time(tenths / 10))
        logged.append(
            logger.warning("throttled", throttle_duration_sec=1.0, throttle_time_source_type=clock)
        )
    assert logged == [True, False, True, False, True]
    # By real time, of which it is known only that it passes.
    often = [logger.warning("seldom", throttle_duration_sec=1000.0) for _ in range(3)]
    assert often == [True, False, False]
    with pytest.raises(TypeError, match="unknown keyword"):
        logger.info("x", sometimes=True)


def test_rosout(node: Node) -> None:
    received: list[Log] = []
    node.create_subscription(Log, "/rosout", received.append, qos_profile_rosout_default)
    node.get_logger().warning("careful")
    assert spin_until(node, lambda: bool(received))
    assert (received[0].name, received[0].msg, received[0].level) == ("tester", "careful", 30)
    assert received[0].function == "test_rosout"
