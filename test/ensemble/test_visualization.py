# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is shown is what is: poses, sizes and joints as in the state."""

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from ensemble.encode import SCENE
from slap_ros.core import VisibleBody
from slap_ros.domains import get_domain
from slap_ros.encoding.scene_encoder import body_poses
from slap_ros.worlds.panda import grasp_pose

STAMP = Time(sec=1, nanosec=2)


@pytest.mark.parametrize(
    "name", ["obstacle2d", "obstacle_tower", "cluttered_drawer", "cleanup_table"]
)
def test_every_object_but_the_arm_is_a_marker_and_a_frame(name):
    domain = get_domain(name)
    state = domain.task(0).initial_state
    bodies = domain.display.bodies(state)
    shown = {marker.text for marker in SCENE.markers(bodies, STAMP).markers}
    framed = {frame.child_frame_id for frame in SCENE.frames(body_poses(bodies), STAMP).transforms}
    everything = {obj.name for obj in state.objects}
    assert shown == framed
    assert everything - shown <= {"robot", "bin"}  # a bin is shown by its parts


def test_blocks_of_the_tower_are_where_they_are_and_as_large():
    domain = get_domain("obstacle_tower")
    state = domain.task(0).initial_state
    for marker in SCENE.markers(domain.display.bodies(state), STAMP).markers:
        obj = state.layout.object(marker.text)
        position = [marker.pose.position.x, marker.pose.position.y, marker.pose.position.z]
        assert np.array_equal(position, state[obj][:3])
        assert marker.scale.z == pytest.approx(2 * float(state.get(obj, "half_z")))


def test_meshes_are_shown_by_their_triangles():
    domain = get_domain("cleanup_table", "paper")
    state = domain.task(0).initial_state
    shown = {
        marker.text: marker for marker in SCENE.markers(domain.display.bodies(state), STAMP).markers
    }
    duck, table = shown["duck"], shown["table"]
    assert (duck.type, table.type) == (Marker.TRIANGLE_LIST, Marker.CUBE)
    assert (duck.scale.x, duck.scale.y, duck.scale.z) == (1.0, 1.0, 1.0)
    assert len(duck.points) % 3 == 0
    lowest = duck.pose.position.z + min(point.z for point in duck.points)
    assert lowest == pytest.approx(0.0)  # it stands on the table
    assert table.points == []


def test_the_arm_is_shown_where_it_is():
    domain = get_domain("obstacle_tower")
    state = domain.task(0).initial_state
    shown = {body.name: body for body in domain.display.arm(state)}
    assert len(shown) == 11
    x, y, z = grasp_pose(state.data[:7]).position
    hand = shown["panda_hand"]
    assert hand.position[:2] == pytest.approx((x, y), abs=0.02)
    assert 0.0 < hand.position[2] - z < 0.1  # over what it would grasp
    assert all(body.position[2] > 0.0 for body in shown.values())
    array = SCENE.markers(tuple(shown.values()), STAMP, "robot")
    assert {marker.ns for marker in array.markers} == {"robot"}


def test_joint_states_are_those_of_the_arm_and_only_of_an_arm():
    tower = get_domain("obstacle_tower").task(0).initial_state
    message = SCENE.joint_state(tower, STAMP)
    assert list(message.name) == [f"panda_joint{i}" for i in range(1, 8)]
    assert np.array_equal(message.position, tower.data[:7])
    assert SCENE.joint_state(get_domain("obstacle2d").task(0).initial_state, STAMP).name == []


def test_a_domain_may_write_whole_numbers_and_numbers_of_numpy():
    half = np.float32(0.5)
    body = VisibleBody("cup", (1, half, 0), (0, 0, 0, 1), (1, 1, 1), (0, half, 1, 1))
    sent = serialize_message(SCENE.markers([body], STAMP))
    (marker,) = deserialize_message(sent, MarkerArray).markers
    colour, position = marker.color, marker.pose.position
    assert (colour.r, colour.g, colour.b, colour.a) == (0.0, 0.5, 1.0, 1.0)
    assert (position.x, position.y, position.z) == (1.0, 0.5, 0.0)
