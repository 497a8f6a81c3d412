# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a camera knows of tags: their direction. Their distance is taken from elsewhere."""

import itertools
import math

import numpy as np
import pytest
import yaml

from slap_ros.domains import get_domain
from slap_ros.errors import InvalidStateError
from slap_ros.geometry.pose import (
    IDENTITY,
    NO_ROTATION,
    ORIGIN,
    Pose,
    from_rotation_vector,
    from_yaw,
    multiply,
)
from slap_ros.robot.grasp_tracking import (
    expected_pose,
    grasp_as_seen,
    is_lost,
    narrowest_width,
)
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import PANDA, Workspace
from slap_ros.robot.line_of_sight import Ways, across, is_slanted, mirrored
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.scene_config import scene_config
from slap_ros.robot.state_assembly import Grasp
from slap_ros.robot.tag_places import face_poses
from slap_ros.robot.tagged_scene import placed_tags, tagged_scene
from slap_ros.robot.tracking import LONGEST, Detection, Track, TrackingSettings, still
from slap_ros.vision.pinhole_camera import PinholeCamera, looking_at
from slap_ros.vision.tags import tag_frame
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.scene import TABLE, TABLE_TOP, cube
from slap_ros.worlds.joint_space.settling import resting_poses
from slap_ros.worlds.panda import HOME
from slap_ros.worlds.settling import levelled

EYE = (1.05, -0.45, 0.75)  # m
CAMERA = looking_at(EYE, (0.5, 0.0, 0.1))
DOMAIN = get_domain("obstacle_tower", "fair")
TASK = DOMAIN.task(1)


def farther(point, by):
    """A point as seen at a wrong distance, m."""
    sight = np.subtract(point, EYE)
    return tuple((np.array(point) + by * sight / np.linalg.norm(sight)).tolist())


@pytest.mark.parametrize("errors", [(0.01, -0.01, 0.006), (-0.03, 0.01, -0.02)])
def test_a_tower_seen_at_wrong_distances_stands_where_it_is(errors):
    """What is a centimetre too high or too low is beside its place as well."""
    cubes = [cube(f"block{i}") for i in range(3)]
    true = [(0.5, 0.05, TABLE_TOP + 0.05 * (i + 0.5)) for i in range(3)]
    seen = {i: Pose(farther(true[i], errors[i])) for i in range(3)}
    fixed = [TABLE.at(TABLE.pose)]
    found = resting_poses(seen, cubes, fixed, dict.fromkeys(seen, EYE))
    for i, pose in found.items():
        assert pose.position == pytest.approx(true[i], abs=1e-4)
    upright = resting_poses(seen, cubes, fixed)
    assert math.dist(upright[0].position, true[0]) > 0.005


@pytest.mark.parametrize("by", [0.03, 0.04, 0.055, 0.07])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_covered_tag_puts_its_block_neither_into_the_table_nor_beside_the_tower(which, by):
    """An edge under a finger makes a tag seem smaller: so it is nearer than seen, never further."""
    cubes = [cube(f"block{i}") for i in range(3)]
    true = [(0.5, 0.05, TABLE_TOP + 0.05 * (i + 0.5)) for i in range(3)]
    seen = {i: Pose(farther(at, by if i == which else 0.002)) for i, at in enumerate(true)}
    found = resting_poses(seen, cubes, [TABLE.at(TABLE.pose)], dict.fromkeys(seen, EYE))
    for i, pose in found.items():
        assert pose.position == pytest.approx(true[i], abs=1e-4)


def test_a_camera_level_with_the_table_says_no_place_along_its_sight():
    """There a millimetre of height would be decimetres of distance."""
    seen = Pose((0.5, 0.0, TABLE_TOP + 0.025 + 0.005))
    level = {0: (1.5, 0.0, TABLE_TOP + 0.03)}
    (found,) = resting_poses({0: seen}, [cube("a")], [TABLE.at(TABLE.pose)], level).values()
    assert found.position == pytest.approx((0.5, 0.0, TABLE_TOP + 0.025), abs=1e-9)


def test_tags_that_come_and_go_in_pictures_move_nothing():
    """Each is seen at another distance: their mean jumps with every tag that is found or missed."""
    track, true = Track(TrackingSettings()), (0.5, 0.1, 0.1)
    for number in range(1, 24):
        if number == 11:
            first = track.estimate(0.0)
            assert first.at_rest
            track.remember(first)
        for frame, error in (("a", 0.009), ("b", -0.009))[number % 2 :]:
            pose = Pose(farther(true, error), NO_ROTATION)
            track.add(Detection(0.1 * number, pose, frame, EYE))
    assert track.estimate(1.0).pose == first.pose
    beside = np.cross(np.subtract(true, EYE), (0.0, 0.0, 1.0))
    moved = np.array(true) + 0.012 * beside / np.linalg.norm(beside)
    for number in range(24, 34):
        pose = Pose(tuple(moved.tolist()), NO_ROTATION)
        track.add(Detection(0.1 * number, pose, "a", EYE))
    assert track.estimate(2.35).pose.position == pytest.approx(tuple(moved.tolist()))


def test_only_errors_of_the_distance_are_left_out():
    """Also where there is a camera, what is 11 cm nearer has been moved."""
    point = (0.5, 0.1, 0.1)
    near = np.subtract(farther(point, 0.01), point)
    assert across(near, point, EYE) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert across(near, point, None) == tuple(near)
    far = np.subtract(farther(point, 0.11), point)
    assert math.hypot(*across(far, point, EYE)) == pytest.approx(0.03)
    assert across((0.0, 0.0, 0.0), EYE, EYE) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("degrees", "slanted"), [(0.0, False), (55.0, False), (80.0, True), (100.0, True)]
)
def test_tags_seen_from_the_side_are_slanted(degrees, slanted):
    turn = from_rotation_vector((math.pi - math.radians(degrees), 0.0, 0.0))
    assert is_slanted(Pose((0.0, 0.0, 1.0), turn)) == slanted


def in_picture(seen, size=0.04):
    """Corners of a tag, pixels of a camera with f = 900 pixels."""
    half = 0.5 * size
    corners = [(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)]
    return np.array([(900.0 * x / z, 900.0 * y / z) for x, y, z in map(seen.apply, corners)])


def tags_of_blocks(lean=0.0):
    """Tags of blocks on the table that are not slanted, in the camera's frame; and block in tag."""
    for x, yaw in ((0.3, 0.1), (0.45, 0.9), (0.6, 1.4), (0.7, 0.5)):
        turn = from_yaw(yaw) if lean == 0.0 else from_rotation_vector((0.0, lean, yaw))
        block = Pose((x, 0.1, TABLE_TOP + 0.025), turn)
        for tag in face_poses((0.025, 0.025, 0.025)):
            seen = CAMERA.inverse().compose(block).compose(tag)
            if not is_slanted(seen):
                yield block, seen, tag.inverse()


def test_a_tag_that_faces_the_other_way_has_the_same_picture():
    """But for the perspective within it: the pictures differ by less than a covered corner does."""
    for _, seen, _ in tags_of_blocks():
        other = mirrored(seen)
        assert seen.angle_to(other) > 1.0
        assert np.abs(in_picture(seen) - in_picture(other)).max() < 1.0
        assert mirrored(other).angle_to(seen) < 1e-9
    assert mirrored(IDENTITY) == IDENTITY  # in the camera, nothing faces it


def lies_flat(pose):
    return levelled(pose) is not None


def test_what_lies_on_a_table_says_which_way_its_tags_face():
    told = 0
    for block, seen, offset in tags_of_blocks():
        assert Ways.of(CAMERA, seen, offset).at_rest(None).angle_to(block) < 1e-9
        turned = Ways.of(CAMERA, mirrored(seen), offset)
        if not lies_flat(turned.seen):
            found, told = turned.at_rest(None), told + 1
            assert math.dist(found.position, block.position) < 1e-9
            assert found.angle_to(block) < 1e-9
    assert told > 3


def test_what_lies_flat_both_ways_has_not_rolled_over_since_it_lay_still():
    both = 0
    for block, seen, offset in tags_of_blocks():
        right, turned = (Ways.of(CAMERA, way, offset) for way in (seen, mirrored(seen)))
        assert right.at_rest(block).angle_to(block) < 1e-9
        assert turned.at_rest(block).angle_to(block) < 1e-9
        if lies_flat(turned.seen):  # where nothing is known, and where it lay as it seems now
            both += 1
            assert turned.at_rest(None) == turned.at_rest(turned.seen) == turned.seen
    assert both > 0


@pytest.mark.parametrize("lean", [0.2, 0.3, 0.4, 0.5])
def test_what_leans_is_not_turned_so_that_it_lies_flat(lean):
    """A block in the hand, or against another one, may lie flat if its tag is mirrored."""
    for block, seen, offset in tags_of_blocks(lean):
        for way in (seen, mirrored(seen)):
            assert Ways.of(CAMERA, way, offset).in_hand(block).angle_to(block) < 1e-9
        slipped = Pose(block.position, multiply(block.quaternion, from_yaw(0.4)))
        ways = Ways.of(CAMERA, seen, offset)
        assert ways.in_hand(slipped) == ways.at_rest(slipped) == ways.seen


def test_a_finger_over_a_corner_turns_no_block():
    """The cause: of both minima, the wrong one fits a covered tag better."""
    vision = pytest.importorskip("slap_ros.vision.tag_detection")
    pytest.importorskip("cv2")
    camera, turned = PinholeCamera.centred(960, 540, 900.0), 0
    for block, seen, offset in tags_of_blocks():
        for corner, by in itertools.product(range(4), ((2.0, 0.0), (0.0, 2.0), (-1.5, 1.5))):
            corners = in_picture(seen) + np.array([camera.cx, camera.cy])
            corners[corner] += by
            ways = Ways.of(CAMERA, vision.tag_pose(corners, camera, 0.04), offset)
            turned += ways.seen.angle_to(block) > 0.5
            assert ways.at_rest(block).angle_to(block) < 0.5
    assert turned > 3


class TaggedBench:
    """A RobotWorld that is told of tags, as a camera sees them."""

    def __init__(self):
        state = TASK.initial_state
        self.config = scene_config(yaml.safe_load(tagged_scene(DOMAIN, state)), "here", DOMAIN)
        self.tags = placed_tags(self.config)
        tracking = TrackingSettings(hidden_after=5)
        self.world = RobotWorld(DOMAIN, self.config, PANDA.scaled(0.5, Workspace()), tracking)
        self.now = 0.0
        self.poses = {
            obj: Pose(*parts(obj, state)) for obj in state.objects if obj.name.startswith("block")
        }
        (robot,) = [o for o in state.objects if o.type.name == "robot"]
        self.joints = tuple(float(state.get(robot, f.name)) for f in JOINT_FEATURES)

    def look(self, error=0.0, slanted_error=0.0, without=(), turned=(), times=12):
        for _ in range(times):
            self.now += 0.1
            for tag in self.tags:
                pose = self.poses[tag.obj].compose(tag.pose)
                seen = CAMERA.inverse().compose(pose)
                wrong = slanted_error if is_slanted(seen) else error
                pose = Pose(farther(pose.position, wrong), pose.quaternion)
                seen = CAMERA.inverse().compose(pose)
                if tag.obj.name in turned:
                    seen = mirrored(seen)
                if tag.obj.name not in without:
                    self.world.add_detection(tag_frame(tag.tag), self.now, CAMERA, seen)
            self.world.add_picture(self.now)
            self.world.add_joint_reading(JointReading(self.now, self.joints, gap=0.08))


def parts(obj, state):
    x, y, z, *turn = (float(state.get(obj, f.name)) for f in POSE_FEATURES)
    return (x, y, z), tuple(turn)


def test_a_state_by_camera_is_the_task_in_spite_of_distances_and_slanted_tags():
    bench = TaggedBench()
    bench.look(error=0.008, slanted_error=0.05)
    state = bench.world.measure(0.0)
    for obj, pose in bench.poses.items():
        assert parts(obj, state)[0] == pytest.approx(pose.position, abs=3e-4)
    space = DOMAIN.atom_space(TASK.initial_state)
    assert space.abstract(state) == space.abstract(TASK.initial_state)


def test_a_state_is_the_same_to_the_bit_while_all_tags_seem_to_face_the_other_way():
    bench = TaggedBench()
    bench.look()
    before, since = bench.world.measure(0.0), bench.now
    bench.look(turned=[obj.name for obj in bench.poses])
    after = bench.world.measure(since)
    for obj in bench.poses:
        assert parts(obj, after) == parts(obj, before)


def test_a_tag_inside_the_camera_is_no_fault():
    bench = TaggedBench()
    bench.world.add_detection(tag_frame(bench.tags[0].tag), 0.1, CAMERA, Pose(ORIGIN))


def test_what_moves_where_nothing_sees_it_is_where_the_model_has_it():
    """An arm hides what it moves; where that was before, other blocks or the arm may be by now."""
    bench = TaggedBench()
    dropped, other = (TASK.initial_state.layout.object(name) for name in ("block2", "block1"))
    bench.poses[dropped] = Pose((0.4, 0.2, TABLE_TOP + 0.08))  # in the air, as it was seen last
    bench.look()
    before = bench.world.measure(0.0)
    bench.world.plan_command(np.zeros(8))
    since = bench.now
    bench.look(without=("block2",))
    after = bench.world.measure(since)
    assert before.get(dropped, "z") == pytest.approx(TABLE_TOP + 0.08, abs=1e-3)
    assert after.get(dropped, "z") == pytest.approx(TABLE_TOP + 0.025, abs=1e-3)
    assert parts(other, after) == parts(other, before)
    bench.poses[dropped] = Pose((0.4, 0.25, TABLE_TOP + 0.025))
    since = bench.now
    bench.look()  # it is seen again: elsewhere
    assert bench.world.measure(since).get(dropped, "y") == pytest.approx(0.25, abs=1e-3)
    since = bench.now
    bench.look(without=("block2",))  # and hidden again, where it is
    assert bench.world.measure(since).get(dropped, "y") == pytest.approx(0.25, abs=1e-3)


def test_what_is_seen_leaves_no_room_for_what_the_model_has_of_hidden_objects():
    """Our physics may push a block to where another one is seen: then it has stayed."""
    bench = TaggedBench()
    dropped, other = (TASK.initial_state.layout.object(name) for name in ("block2", "block1"))
    above, below = Pose((0.4, 0.2, TABLE_TOP + 0.08)), Pose((0.4, 0.2, TABLE_TOP + 0.025))
    bench.poses[dropped] = above
    bench.look()
    before = bench.world.measure(0.0)
    bench.world.plan_command(np.zeros(8))  # the model has it fall
    since, bench.poses[other] = bench.now, below
    bench.look(without=("block2",))
    after = bench.world.measure(since)
    assert after.get(dropped, "z") == pytest.approx(before.get(dropped, "z"), abs=0.01)
    assert parts(other, after)[0] == pytest.approx(below.position, abs=1e-3)


@pytest.mark.parametrize("into", [0.01, 0.03])
def test_a_hidden_block_has_made_room_for_one_that_is_seen_in_its_place(into):
    """A row of blocks is pushed: the first is seen again, and the next one is not."""
    bench = TaggedBench()
    pushed, hidden = (TASK.initial_state.layout.object(name) for name in ("block1", "block2"))
    z = TABLE_TOP + 0.025
    bench.poses[pushed], bench.poses[hidden] = Pose((0.4, 0.2, z)), Pose((0.4, 0.26, z))
    bench.look()
    bench.world.measure(0.0)
    since, bench.poses[pushed] = bench.now, Pose((0.4, 0.21 + into, z))
    bench.look(without=("block2",))
    after = bench.world.measure(since)
    assert parts(pushed, after)[0] == pytest.approx((0.4, 0.21 + into, z), abs=1e-3)
    assert parts(hidden, after)[0] == pytest.approx((0.4, 0.26 + into, z), abs=0.007)
    since = bench.now
    bench.look(without=("block2",))  # and there it stays
    assert parts(hidden, bench.world.measure(since)) == parts(hidden, after)


def test_hidden_blocks_that_nothing_is_seen_in_stay_to_the_bit():
    bench = TaggedBench()
    bench.look()
    before, since = bench.world.measure(0.0), bench.now
    bench.look(without=[obj.name for obj in bench.poses][1:])
    assert parts(list(bench.poses)[1], bench.world.measure(since)) == parts(
        list(bench.poses)[1], before
    )


def test_pictures_that_show_nothing_hide_everything_but_not_for_long():
    """A hand before the camera hides all blocks for a while; a cap before it does not end."""
    bench = TaggedBench()
    bench.look()
    before, since = bench.world.measure(0.0), bench.now
    everything = [obj.name for obj in bench.poses]
    bench.look(without=everything)
    after = bench.world.measure(since)
    assert all(parts(obj, after) == parts(obj, before) for obj in bench.poses)
    bench.look(without=everything, times=LONGEST)
    assert bench.world.measure(since) is None


def test_a_block_seen_where_it_cannot_be_is_where_it_was():
    """Whatever covers its tags, however long one waits: it seems to be inside another block."""
    bench = TaggedBench()
    wrong, other = (TASK.initial_state.layout.object(name) for name in ("block1", "block2"))
    bench.look()
    before, since = bench.world.measure(0.0), bench.now
    x, y, z = bench.poses[other].position
    bench.poses[wrong] = Pose((x + 0.008, y - 0.006, z), from_yaw(0.5))
    bench.look()
    with pytest.raises(InvalidStateError, match="inside one another"):
        bench.world.measure(since)
    after = bench.world.measure(since, moving=True)
    assert all(parts(obj, after) == parts(obj, before) for obj in bench.poses)


@pytest.mark.parametrize("error", [-0.055, 0.055])
def test_fingers_over_an_edge_of_a_tag_neither_move_nor_lose_its_block(error):
    """All of the edge is shifted: the corners are still a square's, but of another size."""
    bench = TaggedBench()
    bench.look()
    before, since = bench.world.measure(0.0), bench.now
    bench.look(error=error)
    after = bench.world.measure(since)
    assert all(parts(obj, after) == parts(obj, before) for obj in bench.poses)
    reading = JointReading(1.0, tuple(HOME), gap=0.05)
    grasp = Grasp(TASK.initial_state.layout.object("block1"), Pose((0.0, 0.0, 0.1)), 0.025)
    held = expected_pose(grasp, reading)
    seen = Pose(farther(held.position, error), held.quaternion)
    assert not is_lost(grasp, reading, still(seen, 10, EYE))
    x, y, z = held.position
    fallen = Pose((x, y, z - 0.1), held.quaternion)
    assert is_lost(grasp, reading, still(fallen, 10, EYE))


@pytest.mark.parametrize("error", [-0.01, 0.01])
def test_a_slip_in_the_hand_is_known_but_for_how_far_away_it_is_seen(error):
    reading = JointReading(1.0, tuple(HOME), gap=0.05)
    grasp = Grasp(TASK.initial_state.layout.object("block1"), Pose((0.0, 0.0, 0.1)), 0.025)
    held = expected_pose(grasp, reading)
    beside = np.cross(np.subtract(held.position, EYE), (0.0, 0.0, 1.0))
    slipped = np.array(held.position) + 0.012 * beside / np.linalg.norm(beside)
    seen = Pose(farther(tuple(slipped.tolist()), error), held.quaternion)
    found = expected_pose(grasp_as_seen(grasp, reading, still(seen, 10, EYE)), reading)
    assert found.position == pytest.approx(tuple(slipped.tolist()), abs=3e-4)


def test_turned_blocks_keep_their_turn():
    seen = Pose(farther((0.5, 0.0, TABLE_TOP + 0.025), 0.01), from_yaw(0.4))
    (found,) = resting_poses({0: seen}, [cube("a")], [TABLE.at(TABLE.pose)], {0: EYE}).values()
    assert found.angle_to(seen) < 1e-9


@pytest.mark.parametrize("beside", [0.0, 0.012, -0.02])
def test_how_narrow_a_tool_is_does_not_depend_on_where_it_is_in_the_hand(beside):
    """The model's fingers stand as far from the middle as the side that is further away."""
    domain = get_domain("cleanup_table")
    world = domain.make_world(domain.task(1).initial_state)
    with world:
        (wiper,) = [body for body in world.scene.free if body.name == "wiper"]
    grasp = Pose((0.0, beside, 0.1), from_yaw(0.5 * math.pi))
    across_it = narrowest_width(wiper, Pose((0.0, beside, 0.1)))
    along_it = narrowest_width(wiper, grasp)
    assert 0.01 < across_it < 0.02 < along_it
    tool = domain.task(1).initial_state.layout.object("wiper")
    held = Grasp(tool, Pose((0.0, beside, 0.1)), 0.01 + abs(beside), across_it)
    closed = JointReading(1.0, tuple(HOME), gap=0.018)
    assert not is_lost(held, closed, None)
    assert is_lost(held, JointReading(2.0, tuple(HOME), gap=0.001), None)
