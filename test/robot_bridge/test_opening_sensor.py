# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Openings of drawers and lids from where their moving parts are detected."""

import pytest

from slap_ros.domains.make_coffee.scenery import holder
from slap_ros.domains.stow_hammer.scenery import SHAPE
from slap_ros.errors import InvalidMeasurementError
from slap_ros.geometry.pose import ORIGIN, Pose, from_rotation_vector, from_yaw, rotate
from slap_ros.robot.opening_sensor import PATH_TOLERANCE_M, PATH_TOLERANCE_RAD, OpeningSensor
from slap_ros.robot.tracking import PoseEstimate, still
from slap_ros.worlds.bodies import WOOD
from slap_ros.worlds.contact.scene import JointKind

FRAMES = (Pose((0.5, 0.3, 0.0), from_yaw(1.7)), Pose((0.4, -0.2, 0.1), (0.5, 0.5, -0.5, 0.5)))
bodies = pytest.mark.parametrize(
    "body", [SHAPE.body("cabinet0", WOOD), holder("holder")], ids=["drawer", "lid"]
)


def moving(body, frame, opening, rate):
    """What is known of a moving part that opens at a rate, m/s or rad/s."""
    axis = rotate(frame.compose(body.joint.mount).quaternion, body.joint.axis)
    way = tuple(rate * along for along in axis)
    slides = body.joint.kind is JointKind.SLIDE
    velocity, spin = (way, ORIGIN) if slides else (ORIGIN, way)
    pose = body.moving_pose(frame, opening)
    return PoseEstimate(pose, velocity, spin, at_rest=False, weight=1)


def turned_round(pose):
    """The same pose: a quaternion and its opposite are one rotation."""
    return Pose(pose.position, tuple(-part for part in pose.quaternion))


@bodies
@pytest.mark.parametrize("frame", FRAMES)
def test_an_opening_is_exactly_where_along_its_path_the_part_is(body, frame):
    sensor = OpeningSensor(body, frame)
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        opening = share * body.joint.high
        pose = body.moving_pose(frame, opening)
        for seen in (pose, turned_round(pose)):
            sensor.require_on_path(seen)
            measured = sensor.opening(still(seen, 3))
            assert measured.position == pytest.approx(opening, abs=1e-12)
            assert measured.still
    for rate in (0.3, -0.3):
        measured = sensor.opening(moving(body, frame, 0.5 * body.joint.high, rate))
        assert measured.velocity == pytest.approx(rate)


@bodies
def test_at_its_ends_a_joint_stops(body):
    """Detections are off by a little; a state that is beyond the range would be refused."""
    frame, little = FRAMES[0], 1e-3
    sensor = OpeningSensor(body, frame)
    for end, outwards in ((0.0, -1.0), (body.joint.high, 1.0)):
        beyond = end + outwards * little
        seen = moving(body, frame, beyond, 0.2 * outwards)
        sensor.require_on_path(seen.pose)
        assert sensor.opening(seen) == (end, 0.0)
        back = sensor.opening(moving(body, frame, beyond, -0.2 * outwards))
        assert (back.position, back.velocity) == (end, pytest.approx(-0.2 * outwards))


@bodies
def test_what_is_seen_beside_the_path_belongs_to_something_else(body):
    frame = FRAMES[0]
    sensor, middle = OpeningSensor(body, frame), 0.5 * body.joint.high
    position, quaternion = body.moving_pose(frame, middle)
    x, y, z = position
    sensor.require_on_path(Pose((x, y, z + 0.9 * PATH_TOLERANCE_M), quaternion))
    beside = [
        Pose((x, y, z + 1.1 * PATH_TOLERANCE_M), quaternion),
        Pose(position, from_rotation_vector((0.0, 0.0, 1.0))),
        body.moving_pose(frame, body.joint.high + 1.1 * PATH_TOLERANCE_RAD),
        body.moving_pose(frame, -1.1 * PATH_TOLERANCE_RAD),
    ]
    for seen in beside:
        with pytest.raises(
            InvalidMeasurementError, match=rf"opens of {body.name} .* another thing"
        ):
            sensor.require_on_path(seen)
