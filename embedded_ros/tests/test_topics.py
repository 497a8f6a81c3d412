# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics between processes."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_sensor_data,
    qos_profile_system_default,
)
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.wait_for_message import wait_for_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String

from conftest import TIMEOUT_S, Process, spin_until, wait_until

Run = Callable[..., Process]
LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_messages_come_back_in_order(node: Node, run: Run) -> None:
    received: list[str] = []
    publisher = node.create_publisher(String, "in", 100)
    subscription = node.create_subscription(
        String, "out", lambda message: received.append(message.data), 100
    )
    run("echo").wait_for_line("ready")
    assert wait_until(lambda: publisher.get_subscription_count() == 1)
    assert wait_until(lambda: subscription.get_publisher_count() == 1)

    def answered() -> bool:
        publisher.publish(String(data="probe"))
        return bool(received)

    assert spin_until(node, answered)  # the other side has discovered our subscription as well
    sent = [f"message {index}" for index in range(20)]
    for text in sent:
        publisher.publish(String(data=text))
    assert spin_until(node, lambda: sent[-1] in received)
    assert [text for text in received if text != "probe"] == sent


def test_a_late_joiner_gets_as_many_latched_messages_as_the_depth(node: Node, run: Run) -> None:
    run("latched").wait_for_line("ready")
    latched: list[str] = []
    node.create_subscription(String, "plan", lambda m: latched.append(m.data), LATCHED)
    assert spin_until(node, lambda: len(latched) == 3)
    spin_until(node, lambda: False, 0.2)
    assert latched == ["2", "3", "4"]


def test_a_late_joiner_that_does_not_ask_for_it_gets_none(node: Node, run: Run) -> None:
    run("latched").wait_for_line("ready")
    received: list[str] = []
    subscription = node.create_subscription(String, "plan", received.append, 10)
    assert spin_until(node, lambda: subscription.get_publisher_count() == 1)
    spin_until(node, lambda: False, 0.2)
    assert received == []


def test_a_slow_subscription_sees_the_newest(node: Node) -> None:
    received: list[str] = []
    publisher = node.create_publisher(String, "numbers", 10)
    node.create_subscription(String, "numbers", lambda m: received.append(m.data), 2)
    for index in range(10):
        publisher.publish(String(data=str(index)))
    assert spin_until(node, lambda: len(received) == 2)
    assert received == ["8", "9"]


def test_raw_subscriptions_and_publishers(node: Node) -> None:
    received: list[bytes] = []
    publisher = node.create_publisher(JointState, "joints", 10)
    node.create_subscription(JointState, "joints", received.append, 10, raw=True)
    message = JointState(name=["a"], position=[1.0])
    publisher.publish(serialize_message(message))
    assert spin_until(node, lambda: bool(received))
    assert deserialize_message(received[0], JointState) == message
    assert received[0] == serialize_message(message)


def test_wrong_use_is_refused(node: Node) -> None:
    publisher = node.create_publisher(String, "topic", 10)
    with pytest.raises(TypeError, match="/topic: expected std_msgs/msg/String, got Header"):
        publisher.publish(Header())
    with pytest.raises(TypeError, match="no message type"):
        node.create_publisher(int, "topic", 10)
    with pytest.raises(TypeError, match="QoSProfile or int"):
        node.create_publisher(String, "topic", "10")
    with pytest.raises(NotImplementedError, match="MessageInfo is not part of embedded_ros"):
        node.create_subscription(String, "topic", lambda message, info: None, 10)
    with pytest.raises(NotImplementedError, match="event_callbacks is not part"):
        node.create_publisher(String, "topic", 10, event_callbacks=object())
    for name in ("", "a b", "/a//b", "/a/", "a/1b", "~x", "{other}"):
        with pytest.raises(InvalidTopicNameException):
            node.create_publisher(String, name, 10)


def test_incompatible_qos_is_warned_of(node: Node, capfd: pytest.CaptureFixture[str]) -> None:
    received: list[String] = []
    publisher = node.create_publisher(String, "topic", qos_profile_sensor_data)
    node.create_subscription(String, "topic", received.append, 10)
    warnings: list[str] = []

    def warned() -> bool:
        warnings.append(capfd.readouterr().err)
        return "incompatible QoS" in "".join(warnings)

    assert spin_until(node, warned)
    assert "Last incompatible policy: RELIABILITY" in "".join(warnings)
    publisher.publish(String())
    spin_until(node, lambda: False, 0.1)
    assert received == []


def test_qos_that_is_not_provided_is_refused(node: Node) -> None:
    for profile in (
        QoSProfile(depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC),
        QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_AVAILABLE),
    ):
        with pytest.raises(InvalidQoSProfileException, match="is not part of embedded_ros"):
            node.create_publisher(String, "topic", profile)


def test_parameters_override_the_qos_that_a_publisher_lets_them(context: None) -> None:
    given = [
        rclpy.Parameter("qos_overrides./topic.publisher.reliability", value="best_effort"),
        rclpy.Parameter("qos_overrides./topic.publisher_twin.depth", value=3),
    ]
    node = Node("overridden", parameter_overrides=given)
    options = QoSOverridingOptions.with_default_policies
    profile = QoSProfile(depth=7)
    plain = node.create_publisher(String, "topic", profile)
    changed = node.create_publisher(String, "topic", profile, qos_overriding_options=options())
    twin = node.create_publisher(
        String, "topic", profile, qos_overriding_options=options(entity_id="twin")
    )
    heard = node.create_subscription(
        String, "topic", print, profile, qos_overriding_options=options()
    )
    assert plain.qos_profile == heard.qos_profile == profile
    assert changed.qos_profile == QoSProfile(depth=7, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert twin.qos_profile == QoSProfile(depth=3)
    assert node.get_parameter("qos_overrides./topic.subscription.history").value == "keep_last"

    def refuse(_: QoSProfile) -> SetParametersResult:
        return SetParametersResult(successful=False, reason="too deep")

    with pytest.raises(InvalidQosOverridesError, match="/topic are not valid: too deep"):
        node.create_publisher(
            String, "topic", profile, qos_overriding_options=options(callback=refuse)
        )
    node.destroy_node()


def test_every_other_qos_carries_messages(node: Node) -> None:
    minute = rclpy.duration.Duration(seconds=60)
    for index, profile in enumerate(
        [
            qos_profile_system_default,
            qos_profile_sensor_data,
            QoSProfile(history=HistoryPolicy.KEEP_ALL),
            QoSProfile(depth=1, deadline=minute, lifespan=minute),
            QoSProfile(depth=1, liveliness_lease_duration=minute),
        ]
    ):
        received: list[String] = []
        publisher = node.create_publisher(String, f"topic{index}", profile)
        node.create_subscription(String, f"topic{index}", received.append, profile)
        publisher.publish(String())
        assert spin_until(node, lambda received=received: bool(received)), profile


def test_lifespan_is_honoured(node: Node) -> None:
    profile = QoSProfile(
        depth=5,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        lifespan=rclpy.duration.Duration(seconds=0.05),
    )
    received: list[String] = []
    publisher = node.create_publisher(String, "topic", profile)
    publisher.publish(String(data="old"))
    time.sleep(0.2)
    node.create_subscription(String, "topic", lambda m: received.append(m.data), profile)

    def received_one() -> bool:
        publisher.publish(String(data="new"))  # again, as this one may expire as well
        return bool(received)

    assert spin_until(node, received_one)
    assert set(received) == {"new"}


def test_compatibility_can_be_asked_for() -> None:
    reliable, best_effort = QoSProfile(depth=1), qos_profile_sensor_data
    compatibility, reason = qos_check_compatible(reliable, best_effort)
    assert (compatibility, reason) == (QoSCompatibility.OK, "")
    compatibility, reason = qos_check_compatible(best_effort, reliable)
    assert compatibility == QoSCompatibility.ERROR
    assert "Best effort publisher" in reason


def test_destroyed_means_silent(node: Node) -> None:
    received: list[String] = []
    publisher = node.create_publisher(String, "topic", 10)
    subscription = node.create_subscription(String, "topic", received.append, 10)
    assert node.destroy_subscription(subscription)
    assert not node.destroy_subscription(subscription)
    publisher.publish(String())
    spin_until(node, lambda: False, 0.1)
    assert received == []
    assert node.count_subscribers("topic") == 0
    assert node.destroy_publisher(publisher)
    with pytest.raises(RuntimeError, match="closed"):
        publisher.publish(String())


def test_waiting_for_a_message(node: Node, run: Run) -> None:
    run("latched").wait_for_line("ready")
    found, message = wait_for_message(
        String, node, "plan", qos_profile=LATCHED, time_to_wait=TIMEOUT_S
    )
    assert (found, message.data) == (True, "2")
    assert wait_for_message(String, node, "silence", time_to_wait=0.05) == (False, None)
