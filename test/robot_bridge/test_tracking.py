# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Noisy, late, lost and impossible detections, and what is made of them."""

import math

import numpy as np
import pytest

from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.errors import InvalidMeasurementError
from slap_ros.geometry.pose import NO_ROTATION, Pose
from slap_ros.geometry.static_transforms import StaticTransforms
from slap_ros.robot.tracking import Detection, Track, TrackingSettings, measured_pose
from slap_ros.worlds.joint_space.scene import TABLE, TABLE_TOP, Mesh, cube
from slap_ros.worlds.joint_space.settling import resting_poses

SENSING = TrackingSettings(position_noise_m=0.002)
RATE = 30.0  # Hz


def feed(track, place, start_s, count, rng, velocity=(0.0, 0.0, 0.0)):
    for k in range(count):
        at = np.add(place, np.multiply(velocity, k / RATE)) + 0.002 * rng.standard_normal(3)
        track.add(Detection(start_s + (k + 1) / RATE, Pose(tuple(at), NO_ROTATION)))


def test_what_lies_still_is_averaged_and_then_stays_the_same_to_the_bit():
    rng, track = np.random.default_rng(0), Track(SENSING)
    feed(track, (0.5, 0.1, 0.1), 0.0, 10, rng)
    first = track.estimate(0.0)
    assert first.at_rest
    assert first.velocity == (0.0, 0.0, 0.0)
    assert math.dist(first.pose.position, (0.5, 0.1, 0.1)) < 0.003
    track.remember(first)
    changed = 0
    for k in range(1, 200):
        feed(track, (0.5, 0.1, 0.1), float(k), 3, rng)
        again = track.estimate(float(k))
        changed += again is None or again.pose != first.pose
    assert changed <= 1


def test_what_was_pushed_is_averaged_anew():
    rng, track = np.random.default_rng(1), Track(SENSING)
    feed(track, (0.5, 0.1, 0.1), 0.0, 10, rng)
    track.remember(track.estimate(0.0))
    feed(track, (0.52, 0.1, 0.1), 1.0, 3, rng)
    assert track.estimate(1.0) is None  # moved, but not yet known where to
    feed(track, (0.52, 0.1, 0.1), 1.2, 10, rng)
    estimate = track.estimate(1.0)
    assert estimate.at_rest
    assert abs(estimate.pose.position[0] - 0.52) < 0.003


def test_what_moves_has_a_velocity():
    rng, track = np.random.default_rng(2), Track(SENSING)
    feed(track, (0.5, 0.1, 0.1), 0.0, 10, rng, velocity=(0.0, 0.4, 0.0))
    estimate = track.estimate(0.0)
    assert not estimate.at_rest
    assert estimate.velocity[1] == pytest.approx(0.4, abs=0.15)


def test_detections_from_before_say_nothing_about_now():
    rng, track = np.random.default_rng(3), Track(SENSING)
    feed(track, (0.5, 0.1, 0.1), 0.0, 30, rng)
    assert track.estimate(10.0) is None


def test_late_and_repeated_detections_are_refused():
    track = Track(SENSING)
    track.add(Detection(1.0, Pose()))
    for stamp in (1.0, 0.9):
        with pytest.raises(InvalidMeasurementError, match="older"):
            track.add(Detection(stamp, Pose((9.0, 9.0, 9.0))))
    assert track.newest_s == 1.0


@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        ((math.nan, 0, 0), (0, 0, 0, 1)),
        ((0, math.inf, 0), (0, 0, 0, 1)),
        ((0, 0, 0), (0, 0, 0, math.nan)),
        ((0, 0, 0), (0, 0, 0, 0)),
        ((0, 0, 0), (1, 1, 1, 1)),
    ],
)
def test_what_is_no_pose_is_refused(position, quaternion):
    with pytest.raises(InvalidMeasurementError):
        measured_pose(position, quaternion)


def test_a_tower_is_put_together_again():
    """From measurements that are 2 mm and 0.01 rad off: nothing floats, nothing is sunk in."""
    rng = np.random.default_rng(4)
    cubes = [cube(f"block{i}") for i in range(4)]
    measured = {}
    for i in (2, 0, 3, 1):  # from the bottom, but for the order
        x, y, z = (0.5, 0.0, TABLE_TOP + 0.05 * (i + 0.5)) + 0.002 * rng.standard_normal(3)
        a, b, c = 0.005 * rng.standard_normal(3)
        measured[i] = measured_pose((x, y, z), np.array([a, b, c, 1.0]) / math.hypot(a, b, c, 1.0))
    found = resting_poses(measured, cubes, [TABLE.at(TABLE.pose)])
    for i, pose in found.items():
        assert pose.position[2] == pytest.approx(TABLE_TOP + 0.05 * (i + 0.5), abs=1e-12)
        assert pose.position[:2] == measured[i].position[:2]
        assert pose.quaternion[:2] == pytest.approx((0.0, 0.0), abs=1e-12)
        assert pose.angle_to(measured[i]) < 0.03


def test_what_leans_or_floats_is_left_as_it_was_seen():
    leaning = Pose((0.5, 0.0, 0.11), (math.sin(0.2), 0.0, 0.0, math.cos(0.2)))
    floating = Pose((0.4, 0.2, 0.3))
    found = resting_poses({0: leaning, 1: floating}, [cube("a"), cube("b")], [TABLE.at(TABLE.pose)])
    assert found == {0: leaning, 1: floating}


def test_a_toy_is_turned_flat_onto_a_face_but_not_onto_an_edge():
    """A duck on its side leans on its body and its head; flat, it would stand on its middle."""
    toys = shipped()
    leaning = (math.sin(0.05), 0.0, 0.0, math.cos(0.05))
    upright = Pose((0.5, 0.0, TABLE_TOP + 0.022), leaning)
    on_side = Pose(
        (0.4, 0.2, TABLE_TOP + 0.025), (math.sin(math.pi / 4 + 0.05), 0.0, 0.0, math.cos(0.8354))
    )
    table = [TABLE.at(TABLE.pose)]
    bodies = [Mesh("a", toys["duck"]), Mesh("b", toys["duck"]), Mesh("c", toys["toy_robot"])]
    found = resting_poses({0: upright, 1: on_side}, bodies, table)
    assert found[0].angle_to(Pose((0.0, 0.0, 0.0))) < 1e-9
    assert found[1] == on_side
    found = resting_poses({2: on_side}, bodies, table)  # a robot lies flat on its arm
    assert found[2].angle_to(on_side) == pytest.approx(0.1, abs=1e-3)


def test_cameras_hang_from_the_base_by_static_frames():
    frames = StaticTransforms("fr3_link0")
    half = math.sqrt(0.5)
    frames.add("fr3_link0", "post", Pose((1.0, 0.0, 0.0)))
    frames.add("post", "camera", Pose((0.0, 0.0, 1.0), (0.0, half, 0.0, half)))
    assert frames.in_base("camera").apply((0.0, 0.0, 0.5)) == pytest.approx((1.5, 0.0, 1.0))
    assert frames.in_base("moon") is None
    frames.add("world", "fr3_link0", Pose((0.0, 2.0, 0.0), (0.0, 0.0, half, half)))
    assert frames.in_base("world").apply((0.0, 2.0, 0.5)) == pytest.approx((0.0, 0.0, 0.5))
    frames.add("world", "ceiling", Pose((0.0, 3.0, 2.0)))
    assert frames.in_base("ceiling").apply((0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 2.0))
    assert frames.in_base("camera").apply((0.0, 0.0, 0.5)) == pytest.approx((1.5, 0.0, 1.0))
    frames.add("egg", "hen", Pose())
    frames.add("hen", "egg", Pose())
    assert frames.in_base("egg") is None


def test_frames_of_one_picture_count_as_their_mean_and_as_one_detection():
    """A block with a tag on each face: what two faces say at once is no second confirmation."""
    track = Track(TrackingSettings())
    for number in range(10):
        for frame, x in (("tag36h11:0", 0.001), ("tag36h11:1", 0.003)):
            assert number == 9 or track.estimate(-1.0) is None
            track.add(Detection(0.1 * number, Pose((x, 0.0, 0.0)), frame))
    found = track.estimate(-1.0)
    assert found.at_rest
    assert found.weight == 10
    assert found.pose.position[0] == pytest.approx(0.002)
    with pytest.raises(InvalidMeasurementError):
        track.add(Detection(0.9, Pose(), "tag36h11:1"))  # sent twice
    with pytest.raises(InvalidMeasurementError):
        track.add(Detection(0.85, Pose(), "tag36h11:2"))  # late
