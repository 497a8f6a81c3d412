# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the world is told: of spoilt joint states where the arm is, or nothing; and of pictures."""

import math
import random

import pytest
import rclpy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ensemble.robot_parameters import RobotParameters
from ensemble.steady_time import JumpFreeClock
from slap_ros.domains import get_domain
from slap_ros.robot.limits import PANDA, Workspace

pytest.importorskip("pybullet")
from robot_bridge.sensors import Sensors
from robot_bridge.transforms import transform
from slap_ros.geometry.pose import IDENTITY
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.scene_config import sampled_scene_config
from slap_ros.vision.tags import SEARCHED

pytestmark = pytest.mark.timeout(3600)  # for as many cases as somebody may ask for
ARM = [f"panda_joint{i + 1}" for i in range(7)]
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
TRUE = dict(zip(ARM, (0.4, 0.3, 0.2, -1.4, 0.5, 1.6, 0.7), strict=True)) | dict.fromkeys(
    FINGERS, 0.03
)
LISTS = ("name", "position", "velocity", "effort")


def shortened(rng, lists):
    what = rng.choice([what for what in LISTS if lists[what]])
    lists[what].pop(rng.randrange(len(lists[what])))


def lengthened(rng, lists):
    what = rng.choice(LISTS)
    value = "odd_joint" if what == "name" else 0.0
    lists[what].insert(rng.randint(0, len(lists[what])), value)


def named_twice(rng, lists):
    one, other = rng.sample(range(len(lists["name"])), 2)
    lists["name"][one] = lists["name"][other]


def no_number(rng, lists):
    what = rng.choice(LISTS[1:3])
    lists[what] = lists[what] or [0.0] * len(lists["name"])
    lists[what][rng.randrange(len(lists[what]))] = rng.choice((math.nan, math.inf, -math.inf))


def other_unit(rng, lists):
    lists["position"] = [rng.choice((1e3, math.degrees(1.0))) * q for q in lists["position"]]


def emptied(rng, lists):
    lists[rng.choice(LISTS[1:])] = []


def others_between(rng, lists):
    """Another robot's joints, some of which measure nothing."""
    at = rng.randint(0, len(lists["name"]))
    lists["name"].insert(at, f"rail_{len(lists['name'])}")
    lists["position"].insert(at, rng.choice((1.0, math.nan)))
    for what in LISTS[2:]:
        if lists[what]:
            lists[what].insert(at, 0.0)


SPOILING = (shortened, lengthened, named_twice, no_number, other_unit, emptied)


@pytest.fixture
def sensors(network):
    domain = get_domain("obstacle_tower", "fair")
    scene = sampled_scene_config(domain.task(1).initial_state)
    world = RobotWorld(domain, scene, PANDA.scaled(0.5, Workspace()))
    rclpy.init()
    node = rclpy.create_node("listener")
    try:
        yield Sensors(node, world, RobotParameters(), JumpFreeClock(node))
    finally:
        node.destroy_node()
        world.close()
        rclpy.shutdown()


def joint_state(sensors, lists):
    stamp = sensors._node.get_clock().now().to_msg()
    return JointState(header=Header(stamp=stamp), **lists)


def test_no_joint_state_is_taken_for_another(sensors, request):
    rng = random.Random(4)
    taken = refused = 0
    for _ in range(300 * (1 + request.config.getoption("--fault-cases"))):
        names = rng.sample(list(TRUE), len(TRUE))
        lists = {"name": names, "position": [TRUE[name] for name in names]}
        lists |= {what: [0.0] * len(names) if rng.random() < 0.5 else [] for what in LISTS[2:]}
        # One of them: a second may hide the first, as an entry less and an entry more.
        spoiling = [rng.choice(SPOILING)] if rng.random() < 0.7 else []
        for change in (*spoiling, *[others_between] * rng.randint(0, 2)):
            change(rng, lists)
        before = sensors.counts["readings"], sensors.counts["refused_measurements"]
        sensors._on_joints(joint_state(sensors, lists))
        taken += sensors.counts["readings"] - before[0]
        refused += sensors.counts["refused_measurements"] - before[1]
        if taken:
            assert sensors._world.joint_distance(list(TRUE.values())[:7]) == 0.0
        assert sensors.gap is None or sensors.gap == pytest.approx(0.06)
    assert taken > 50 and refused > 50


def test_velocities_that_nobody_measures_hinder_nothing(sensors):
    """As ros2_control's joint_state_broadcaster has them."""
    lists = {
        "name": list(TRUE),
        "position": list(TRUE.values()),
        "velocity": [math.nan] * len(TRUE),
    }
    sensors._on_joints(joint_state(sensors, lists))
    assert sensors.counts["readings"] == 1 and not sensors.joint_advice


@pytest.mark.parametrize(
    ("by_s", "why"), [(5, "s ahead: are clocks synchronised"), (None, "stamp")]
)
def test_joints_whose_stamp_cannot_be_are_refused_with_the_reason(sensors, by_s, why):
    message = joint_state(sensors, {"name": list(TRUE), "position": list(TRUE.values())})
    if by_s is None:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    else:
        message.header.stamp.sec += by_s
    sensors._on_joints(message)
    assert why in sensors.joint_advice
    assert sensors.counts["readings"] == 0 and sensors.counts["refused_measurements"] == 1


def test_a_picture_that_shows_nothing_was_searched_if_the_robot_knows_the_camera(sensors):
    pictures = []
    for camera in ("somewhere_else", "panda_link0"):
        item = transform(IDENTITY, SEARCHED)
        item.header = Header(stamp=sensors._node.get_clock().now().to_msg(), frame_id=camera)
        sensors._on_frames(TFMessage(transforms=[item]))
        pictures.append(len(sensors._world._detected._pictures))
    assert pictures == [0, 1]
    assert not sensors.counts["detections"]
