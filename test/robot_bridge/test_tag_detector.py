# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The camera of the robot in MuJoCo and the tag detector, as nodes: pictures in, frames out."""

import math

import pytest
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

from ensemble.camera_parameters import OPTICAL_FRAME, CameraParameters
from ensemble.camera_topics import CAMERA_INFO, PICTURES
from ensemble.interfaces import SENSOR_DATA, TF, TF_STATIC
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.robot_parameters import parse_mujoco_robot
from ensemble.spinner import temporary_node
from slap_ros.errors import InvalidParameterError
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.vision.tags import SEARCHED, tag_of_frame

pytest.importorskip("mujoco")
pytest.importorskip("pupil_apriltags")

from support.tagged_tower import tagged_tower

LIMIT = 50.0  # s, far more than anything here takes


def test_the_detector_broadcasts_what_the_camera_sees(network, tmp_path):
    tower = tagged_tower(tmp_path)
    pose = CameraParameters().optical_pose
    nodes = node_parameters(
        RunSettings(
            DomainChoice("obstacle_tower", "fair"),
            *(1, 0, "lazy", None),
            world="mujoco",
            mujoco={"camera": True},
            scene=str(tower.scene_file),
        )
    )
    only = {n: nodes[n] for n in ("robot_bridge.tag_detector", "robot_bridge.mujoco")}
    seen, static = {}, {}

    def hear(message):
        for item in message.transforms:
            seen[item.child_frame_id] = item

    with (
        temporary_node(lambda: Node("listener")) as (node, spinner),
        InProcessLauncher(only, spinner.executor),
    ):
        node.create_subscription(TF.type, TF.name, hear, SENSOR_DATA)
        node.create_subscription(
            TF_STATIC.type,
            TF_STATIC.name,
            lambda m: static.update({i.child_frame_id: i.header.frame_id for i in m.transforms}),
            TF_STATIC.qos,
        )
        assert spinner.spin_until(lambda: len(seen) > 1 and static, LIMIT)
    assert static == {OPTICAL_FRAME: "panda_link0"}
    assert not [frame for frame in seen if frame.startswith("detected_")]
    blocks = set()
    assert seen.pop(SEARCHED).header.frame_id == OPTICAL_FRAME
    for frame, item in seen.items():
        tag = tower.tags[tag_of_frame(frame)]
        assert item.header.frame_id == OPTICAL_FRAME
        blocks.add(tag.obj.name)
        t = item.transform.translation
        true = tower.poses[tag.obj.name].compose(tag.pose).position
        assert math.dist(pose.apply((t.x, t.y, t.z)), true) < 0.01, frame
    assert blocks == set(tower.poses)


def test_pictures_that_cannot_be_used_are_refused_and_the_next_is_searched(network, tmp_path):
    tower = tagged_tower(tmp_path)
    height, width, _ = tower.picture.shape
    detector = {"domain": "obstacle_tower", "scene": str(tower.scene_file)}
    seen = []
    info = CameraInfo(width=width, height=height)
    good = Image(width=width, height=height, encoding="rgb8", step=3 * width)
    good.header.frame_id, good.data = "eye", tower.picture.tobytes()
    bad = [
        Image(width=width, height=height, encoding="16UC1", step=2 * width, data=bytes(9)),
        Image(width=4, height=4, encoding="mono8", step=4, data=bytes(16)),
    ]
    with (
        temporary_node(lambda: Node("driver")) as (node, spinner),
        InProcessLauncher({"robot_bridge.tag_detector": detector}, spinner.executor) as launched,
    ):
        (finder,) = launched._made
        node.create_subscription(TF.type, TF.name, seen.append, SENSOR_DATA)
        infos = node.create_publisher(CameraInfo, CAMERA_INFO.name, CAMERA_INFO.qos)
        pictures = node.create_publisher(Image, PICTURES.name, PICTURES.qos)
        assert spinner.spin_until(
            lambda: infos.get_subscription_count() and pictures.get_subscription_count(), LIMIT
        )
        infos.publish(info)  # not calibrated
        assert spinner.spin_until(lambda: finder._counts["refused"] == 1, LIMIT)
        info.k = [1200.0, 0.0, 639.5, 0.0, 1200.0, 359.5, 0.0, 0.0, 1.0]
        infos.publish(info)
        assert spinner.spin_until(lambda: finder._camera is not None, LIMIT)
        for number, picture in enumerate(bad, start=2):
            pictures.publish(picture)
            assert spinner.spin_until(lambda n=number: finder._counts["refused"] == n, LIMIT)
        pictures.publish(good)
        assert spinner.spin_until(lambda: seen, LIMIT)
        good.data = bytes(len(good.data))  # what is black shows no tag, and was searched
        pictures.publish(good)
        assert spinner.spin_until(lambda: len(seen) == 2, LIMIT)
    assert {item.header.frame_id for item in seen[0].transforms} == {"eye"}
    assert [item.child_frame_id for item in seen[1].transforms] == [SEARCHED]


def test_options_of_the_camera_have_types():
    options = parse_mujoco_robot("camera=true,camera_eye=1 -0.4 0.8,image_blur=0.7")
    assert options == {"camera": True, "camera_eye": (1.0, -0.4, 0.8), "image_blur": 0.7}
    assert parse_mujoco_robot("camera=false") == {"camera": False}
    for wrong in ("camera=maybe", "camera=", "scene=x.yaml", "camera_eye=a b c"):
        with pytest.raises(InvalidParameterError):
            parse_mujoco_robot(wrong)


def test_the_bridge_before_a_camera_has_what_it_has_without_one_and_more():
    """The arm reaches as far and grips as firmly, and it hides what is behind it."""
    choice = DomainChoice("obstacle_tower", "fair")
    bridges = [
        node_parameters(
            RunSettings(choice, 1, 0, "lazy", None, world="mujoco", mujoco=robot, scene="x.yaml")
        )["robot_bridge"]
        for robot in ({}, {"camera": True})
    ]
    without, before = bridges
    assert without.items() <= before.items()
    assert before["hidden_after"] > 0 < before["detection_timeout"]
