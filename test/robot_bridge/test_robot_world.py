# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot as a world: measurements that become states, commands that become motions."""

import math

import numpy as np
import pytest

from robot_bridge.mock.plant import Plant
from slap_ros.domains import get_domain
from slap_ros.errors import (
    InvalidCommandError,
    InvalidMeasurementError,
    InvalidParameterError,
    InvalidSceneError,
    InvalidStateError,
    NoDetectionError,
    UnsafeCommandError,
)
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.motion import linear_motion, shifted
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import PANDA, Workspace
from slap_ros.robot.robot_world import RobotWorld
from slap_ros.robot.scene_config import read_scene_config, sampled_scene_config
from slap_ros.robot.state_assembly import possible_joints
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES
from slap_ros.worlds.panda import HOME, JOINT_HIGH, JOINT_LOW, grasp_pose, hand_pose

DOMAIN = get_domain("obstacle_tower", "fair")
TASK = DOMAIN.task(1)
LIMITS = PANDA.scaled(0.5, Workspace())
DOWN_TO_THE_TABLE = PANDA.scaled(1.0, Workspace((0.0, -0.8, 0.0), (0.9, 0.8, 0.9)))
STEPS = np.zeros(8)


def joints_of(state):
    (robot,) = [o for o in state.objects if o.type.name == "robot"]
    return tuple(float(state.get(robot, f.name)) for f in JOINT_FEATURES)


class Bench:
    """A RobotWorld, and measurements of a simulated world for it."""

    def __init__(self, noise=0.002, limits=LIMITS, tracking=None):
        self.world = DOMAIN.make_world(TASK.initial_state)
        scene = sampled_scene_config(TASK.initial_state)
        self.robot_world = RobotWorld(DOMAIN, scene, limits, tracking or TrackingSettings())
        self.rng, self.noise, self.now = np.random.default_rng(0), noise, 0.0

    def pose(self, obj):
        x, y, z, *turn = (float(self.world.state.get(obj, f.name)) for f in POSE_FEATURES)
        return Pose((x, y, z), tuple(turn))

    def seen(self):
        return [o for o in self.world.state.objects if o.name.startswith("block")]

    def measure(self, times=12, without=()):
        for _ in range(times):
            self.now += 0.03
            for obj in self.seen():
                if obj.name in without:
                    continue
                pose = self.pose(obj)
                at = np.array(pose.position) + self.noise * self.rng.standard_normal(3)
                seen = Pose(tuple(at.tolist()), pose.quaternion)
                self.robot_world.add_detection(f"detected_{obj.name}", self.now, IDENTITY, seen)
            self.robot_world.add_joint_reading(
                JointReading(self.now, self.joints(), gap=self.gap())
            )

    def joints(self):
        return joints_of(self.world.state)

    def gap(self):
        (robot,) = [o for o in self.world.state.objects if o.type.name == "robot"]
        return 2.0 * float(self.world.state.get(robot, "finger"))


@pytest.fixture
def lifted():  # anew for each test: some lose what is held
    """A bench on which a block was picked, by the given skill, through the RobotWorld."""
    bench = Bench()
    bench.measure()
    state = bench.robot_world.measure(0.0)
    space = DOMAIN.atom_space(state)
    robot, block, table = (space.layout.object(name) for name in ("robot", "block1", "table"))
    policy = DOMAIN.skills["Pick"].start(state, (robot, block, table))
    grips = []
    while (action := policy(state)) is not None:
        step = bench.robot_world.plan_command(action)
        grips.append(step.gripper)
        bench.world.step(action)
        if step.gripper is GripperAction.CLOSE:
            assert bench.robot_world.confirm_grasp(bench.gap())
        since = bench.now
        bench.measure()
        state = bench.robot_world.measure(since)
    return bench, state, grips


def test_what_is_measured_is_the_task_to_the_predicates():
    bench = Bench()
    assert bench.robot_world.measure(0.0) is None
    bench.measure()
    state = bench.robot_world.measure(0.0)
    space = DOMAIN.atom_space(TASK.initial_state)
    assert space.abstract(state) == space.abstract(TASK.initial_state)
    assert np.abs(state.data - TASK.initial_state.data).max() < 0.005
    bench.world.reset(state)  # which the planner's model does as well
    after = bench.world.step(STEPS)
    assert after == state  # it stands


def test_a_state_measured_again_is_the_same_state():
    bench = Bench()
    bench.measure()
    first = bench.robot_world.measure(0.0)
    since = bench.now
    bench.measure(times=3)
    assert bench.robot_world.measure(since) == first


def test_a_block_is_picked_closed_loop_from_noisy_states(lifted):
    bench, state, grips = lifted
    block = state.layout.object("block1")
    assert grips.count(GripperAction.CLOSE) == 1
    assert GripperAction.OPEN not in grips
    assert state.get(block, "held") == 1.0
    assert math.dist(bench.pose(block).position, state[block][:3]) < 0.005


def test_a_block_that_does_not_follow_the_hand_was_lost(lifted):
    bench, _, _ = lifted
    block = bench.world.state.layout.object("block1")
    held = bench.world.state
    grasp = bench.robot_world._grasp
    slipped = {(block, f"{axis}"): v for axis, v in zip("xyz", (0.35, 0.3, 0.1), strict=True)}
    try:
        bench.world._state = held.replace(slipped | {(block, "held"): 0.0})
        since = bench.now
        bench.measure()
        state = bench.robot_world.measure(since)
        assert state.get(block, "held") == 0.0
        assert state.get(block, "x") == pytest.approx(0.35, abs=0.003)
        assert bench.robot_world.plan_command(STEPS).gripper is GripperAction.OPEN
    finally:
        bench.world._state = held
        bench.robot_world._grasp, bench.robot_world._lost = grasp, False


def test_a_block_is_not_pressed_into_the_table_that_stops_it(lifted):
    """In the model it would sink in by up to 2 cm; in the hand of a robot it would slip."""
    bench, before, _ = lifted
    block, down = before.layout.object("block1"), np.array([0.0, 0.053, *[0.0] * 6])
    motion = bench.robot_world.plan_command(down).motion
    grasp = bench.robot_world._grasp.pose
    reached = hand_pose(motion.target).compose(grasp)
    edge = OrientedBox(reached, (0.025, 0.025, 0.025))
    table = before.layout.object("table")
    top = float(before.get(table, "z")) + float(before.get(table, "half_z"))
    lowest = min(corner[2] for corner in edge.corners())
    assert before.get(block, "z") - 0.025 > top + 0.01  # it was well over it
    assert -0.0025 < lowest - top < 0.005


@pytest.mark.parametrize("slip", [(0.0, 0.0, 0.02), (0.004, -0.012, 0.008)])
def test_a_block_that_slips_in_the_hand_is_held_where_it_is_seen(lifted, slip):
    """Fingers hold by friction: what was pushed is no longer where it was gripped."""
    bench, before, _ = lifted
    block, held, grasp = before.layout.object("block1"), bench.world.state, bench.robot_world._grasp
    seen = [float(held.get(block, axis)) + d for axis, d in zip("xyz", slip, strict=True)]
    try:
        bench.world._state = held.replace(
            {(block, axis): value for axis, value in zip("xyz", seen, strict=True)}
        )
        since = bench.now
        bench.measure()
        state = bench.robot_world.measure(since)
        assert state.get(block, "held") == 1.0
        assert state[block][:3] == pytest.approx(seen, abs=0.003)
        assert bench.robot_world.plan_command(STEPS).gripper is GripperAction.KEEP
        since = bench.now
        bench.measure(times=3)
        assert bench.robot_world.measure(since) == state  # noise alone changes nothing
        since = bench.now
        bench.measure(without=("block1",))
        assert bench.robot_world.measure(since) == state  # nor does what hides it
    finally:
        bench.world._state, bench.robot_world._grasp = held, grasp


def approached():
    """A bench whose arm went to where it can grasp, by steps of which none was measured."""
    bench = Bench()
    bench.measure()
    state = bench.robot_world.measure(0.0)
    robot, block, table = (state.layout.object(name) for name in ("robot", "block1", "table"))
    policy = DOMAIN.skills["Pick"].start(state, (robot, block, table))
    foreseen = 0
    while True:
        action = policy(state)
        command = bench.robot_world.plan_command(action)
        state = bench.robot_world.expect(command)
        if state is None:
            return bench, command, foreseen
        bench.world.step(action)
        foreseen += 1


def test_steps_of_the_arm_alone_are_foreseen_as_they_are_measured_later():
    bench, command, foreseen = approached()
    expected = bench.robot_world._state
    assert foreseen >= 3
    assert command.gripper is GripperAction.CLOSE  # which acts only from a state that was measured
    since = bench.now
    bench.measure()
    measured = bench.robot_world.measure(since)
    assert np.abs(measured.data - expected.data).max() < 0.005
    space = DOMAIN.atom_space(measured)
    assert space.abstract(measured) == space.abstract(expected)


def foreseen_from(bench, state, action):
    """The steps of an action that are foreseen one after the other, and the one that is not."""
    steps = 0
    while True:
        command = bench.robot_world.plan_command(action)
        expected = bench.robot_world.expect(command)
        if expected is None:
            return steps, state, command
        steps, state = steps + 1, expected


def test_a_step_that_moves_more_than_the_arm_is_to_be_measured():
    """The fingers are around a block, and go sideways until they push it."""
    bench, _, _ = approached()
    since, block = bench.now, bench.world.state.layout.object("block1")
    bench.measure()
    state = bench.robot_world.measure(since)
    _, before, command = foreseen_from(bench, state, np.array([0.02, *[0.0] * 7]))
    assert tuple(before[block]) == tuple(state[block])
    assert command.gripper is GripperAction.KEEP
    assert tuple(command.after[block]) != tuple(before[block])
    assert bench.robot_world._state is before


def test_a_step_that_changes_an_atom_is_to_be_measured(lifted):
    """A skill ends by its atoms: nobody is told that it did before that is known."""
    bench, state, _ = lifted
    space = DOMAIN.atom_space(state)
    lowered = np.array([0.0, 0.004, *[0.0] * 6])
    steps, before, command = foreseen_from(bench, state, lowered)
    assert steps >= 2
    assert space.abstract(before) == space.abstract(state)
    assert space.abstract(command.after) != space.abstract(state)


def test_fingers_that_close_on_nothing_hold_nothing():
    bench = Bench()
    bench.measure()
    bench.robot_world.measure(0.0)
    assert not bench.robot_world.confirm_grasp(0.0)  # not asked to
    close = np.array([*[0.0] * 7, 1.0])
    assert (
        bench.robot_world.plan_command(close).gripper is GripperAction.KEEP
    )  # there is nothing to close around


def test_a_missing_frame_is_missed_by_name():
    bench = Bench()
    bench.measure(without=("block2",))
    assert bench.robot_world.measure(0.0) is None
    assert bench.robot_world.undetected(0.0) == ["block2"]
    told = bench.robot_world.what_is_missing(0.0)
    assert told.startswith("block2; others are seen, but never yet block2: move what is in front")


def test_nothing_is_said_of_what_stands_in_front_where_it_was_seen_or_nothing_is():
    bench = Bench()
    everything = bench.robot_world.what_is_missing(0.0)
    assert "block2" in everything
    assert "in front" not in everything
    bench.measure()
    since = bench.now
    bench.measure(without=("block2",))
    assert bench.robot_world.what_is_missing(since) == "block2"


def test_what_pictures_do_not_show_is_where_it_was_where_that_is_asked_for():
    """An arm between camera and table hides what is behind it, while it works on something else."""
    bench = Bench(tracking=TrackingSettings(hidden_after=5))
    bench.measure(without=("block2",))
    assert bench.robot_world.measure(0.0) is None  # it was never seen
    bench.measure()
    seen = bench.robot_world.measure(0.0)
    since = bench.now
    bench.measure(times=4, without=("block2",))
    assert bench.robot_world.measure(since) is None  # it may only have been missed
    bench.measure(times=1, without=("block2",))
    assert bench.robot_world.measure(since) == seen
    block = bench.world.state.layout.object("block2")
    bench.world._state = bench.world.state.replace({(block, "x"): 0.3, (block, "y"): -0.3})
    since = bench.now
    bench.measure()
    assert bench.robot_world.measure(since)[block][:2] == pytest.approx((0.3, -0.3), abs=0.003)


def test_a_task_lacks_what_no_picture_has_shown_and_its_goal_must_not_be_about_that():
    bench = Bench(tracking=TrackingSettings(hidden_after=5))
    robot_world, block = bench.robot_world, TASK.initial_state.layout.object("block1")
    bench.measure(times=4, without=("block1",))
    assert robot_world.measure_first(0.0) is None  # it may only have been missed
    bench.measure(without=("block1",))
    state = robot_world.measure_first(0.0)
    assert set(TASK.initial_state.objects) - set(state.objects) == {block}
    goal = robot_world.default_goal(state)
    assert goal == TASK.goal
    with pytest.raises(NoDetectionError, match="no picture has shown yet: block1"):
        robot_world.require_seen(goal)
    after = robot_world.plan_command(STEPS).after
    assert after.layout == state.layout

    since = bench.now
    bench.measure()  # it is seen, but the task is under way
    assert robot_world.measure(since).layout == state.layout
    whole = robot_world.measure_first(since)
    assert whole.layout == TASK.initial_state.layout
    assert not robot_world.left_out
    robot_world.require_seen(goal)


def test_without_a_camera_a_task_waits_for_what_was_never_seen():
    bench = Bench()
    bench.measure(times=40, without=("block2",))
    assert bench.robot_world.measure_first(0.0) is None


def test_a_block_that_is_let_go_and_hidden_is_where_the_hand_had_it(lifted):
    bench, _, _ = lifted
    robot_world, held = bench.robot_world, bench.world.state
    grasp, robot_world.tracking = robot_world._grasp, TrackingSettings(hidden_after=5)
    block = held.layout.object("block1")
    try:
        robot_world.confirm_release()
        since = bench.now
        bench.measure(without=("block1",))
        state = robot_world.measure(since)
        assert state.get(block, "held") == 0.0
        assert state[block][:2] == pytest.approx(held[block][:2], abs=0.003)
    finally:
        robot_world._grasp, robot_world.tracking = grasp, TrackingSettings()


def test_a_nan_pose_moves_nothing():
    bench = Bench()
    bench.measure()
    state = bench.robot_world.measure(0.0)
    with pytest.raises(InvalidMeasurementError):
        bench.robot_world.add_detection(
            "detected_block1", 99.0, IDENTITY, Pose((math.nan, 0.0, 0.0))
        )
    with pytest.raises(InvalidMeasurementError):
        bench.robot_world.add_joint_reading(JointReading(99.0, (math.nan,) * 7))
    with pytest.raises(InvalidMeasurementError, match="not 7 numbers"):
        JointReading(99.0, (0.0,) * 6)
    assert bench.robot_world.measure(0.0) == state
    bench.robot_world.add_detection("somebody_else", 99.0, IDENTITY, Pose((math.nan, 0.0, 0.0)))


def test_blocks_seen_inside_one_another_are_no_state():
    bench = Bench(noise=1e-4)
    one, two = bench.seen()[:2]
    features = dict(zip("xyz", bench.pose(one).position, strict=True))
    bench.world._state = bench.world.state.replace({(two, k): v for k, v in features.items()})
    bench.measure()
    with pytest.raises(InvalidStateError, match="inside one another"):
        bench.robot_world.measure(0.0)


def test_commands_are_checked_twice():
    bench = Bench()
    with pytest.raises(InvalidStateError, match="nothing is measured"):
        bench.robot_world.plan_command(STEPS)
    bench.measure()
    bench.robot_world.measure(0.0)
    for bad in (math.nan, math.inf, 0.2):
        action = np.array([bad, *[0.0] * 7])
        with pytest.raises(InvalidCommandError):
            bench.robot_world.plan_command(action)
    with pytest.raises(InvalidCommandError):
        bench.robot_world.plan_command(np.zeros(3))
    tight = Bench(limits=PANDA.scaled(0.5, Workspace((0.2, -0.5, 0.499), (0.8, 0.5, 0.9))))
    tight.measure()
    tight.robot_world.measure(0.0)
    with pytest.raises(UnsafeCommandError, match="outside the workspace"):
        tight.robot_world.plan_command(np.array([0.0, 0.05, *[0.0] * 6]))
    assert tight.robot_world.plan_command(STEPS).motion.target == pytest.approx(tight.joints())


def test_an_arm_that_was_moved_by_hand_is_not_sent_on():
    """The motion was timed for the way from where it was measured."""
    bench = Bench()
    bench.measure()
    bench.robot_world.measure(0.0)
    elsewhere = tuple(q + 0.3 for q in bench.joints())
    bench.robot_world.add_joint_reading(JointReading(bench.now + 0.1, elsewhere))
    with pytest.raises(UnsafeCommandError, match=r"was moved by 0\.300 rad"):
        bench.robot_world.plan_command(STEPS)


def test_an_arm_never_enters_the_table_whatever_is_commanded():
    """Commands that go down and down end on it: a state with the arm in the table is refused."""
    bench = Bench(limits=DOWN_TO_THE_TABLE)
    down = np.array([0.0, 0.053, *[0.0] * 6])
    yielded = 0
    for _ in range(25):
        since = bench.now
        bench.measure()
        assert bench.robot_world.measure(since) is not None
        motion = bench.robot_world.plan_command(down).motion
        way = np.subtract(motion.target, motion.start)
        yielded += not np.allclose(way, down[:7])
        bench.world.step(np.array([*way, 0.0]))
    assert yielded > 5


def lowest_valid(bench):
    """The joints with the hand as low beside the blocks as the model has it, to 0.2 mm."""
    (robot,) = [obj for obj in TASK.initial_state.objects if obj.type.name == "robot"]
    joints = (0.9, *HOME[1:])
    while True:
        lower = lowered(joints, 0.0002)
        named = zip(JOINT_FEATURES, lower, strict=True)
        try:
            bench.world.reset(TASK.initial_state.replace({(robot, f.name): q for f, q in named}))
        except InvalidStateError:
            return joints
        joints = lower


def lowered(joints, depth):
    """The joints with the hand lower by so many metres."""
    way = linear_motion(joints, shifted(grasp_pose(joints), (0.0, 0.0, -depth)))
    return tuple(float(q) for q in way[-1])


def test_a_hand_that_presses_on_the_table_is_a_state_unless_it_is_deep_in_it():
    """A robot's hand is not the model's box: it may press lower than the model ever goes."""
    bench = Bench(limits=DOWN_TO_THE_TABLE)
    bench.measure()
    for depth, refused in ((0.002, False), (0.01, True)):
        since, measured = bench.now, lowered(lowest_valid(bench), depth)
        bench.joints = lambda measured=measured: measured
        bench.measure()
        if refused:
            with pytest.raises(InvalidStateError, match="inside a fixed body"):
                bench.robot_world.measure(since)
            continue
        joints = joints_of(bench.robot_world.measure(since))
        assert 0.001 < grasp_pose(joints).position[2] - grasp_pose(measured).position[2] < 0.003
        assert bench.robot_world.plan_command(STEPS)  # the arm counts as standing where it is


def test_domains_without_a_panda_and_presets_that_jump_are_refused():
    other = get_domain("obstacle2d", "fair")
    with pytest.raises(InvalidParameterError, match="has no Panda"):
        RobotWorld(other, sampled_scene_config(other.task(0).initial_state), LIMITS)
    jumps = get_domain("obstacle_tower", "paper")
    with pytest.raises(InvalidParameterError, match="which a real arm must not"):
        RobotWorld(jumps, sampled_scene_config(jumps.task(0).initial_state), LIMITS)


@pytest.mark.parametrize("name", ["obstacle2d", "peg_in_hole"])
def test_a_mock_robot_of_a_domain_without_a_panda_is_refused(name):
    domain = get_domain(name)
    with pytest.raises(InvalidParameterError, match=f"{name} has no Panda, which the mock robot"):
        Plant(domain, domain.task(0).initial_state)


SCENE = """
objects:
  block1:
    type: block
    frame: tag36h11:1
    offset: [0, 0, -0.025]
    features: {mass: 0.5, friction: 0.9, half_x: 0.025, half_y: 0.025, half_z: 0.025,
               is_movable: 1, is_target: 0}
  target:
    type: surface
    pose: [0.5, 0, 0.0745, 0, 0, 0, 1]
    features: {half_x: 0.026, half_y: 0.026, half_z: 0.0005, is_movable: 0, is_target: 1}
  table:
    type: surface
    pose: [0.5, 0, -0.175, 0, 0, 0, 1]
    features: {half_x: 0.25, half_y: 0.4, half_z: 0.25, is_movable: 0, is_target: 0}
"""


def test_a_scene_file_says_what_there_is(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    scene_config = read_scene_config(path, DOMAIN)
    robot_world = RobotWorld(DOMAIN, scene_config, LIMITS)
    for k in range(1, 12):  # a tag on top of the block, seen by a camera at the base
        robot_world.add_detection("tag36h11:1", k * 0.03, IDENTITY, Pose((0.5, 0.2, 0.125)))
        robot_world.add_joint_reading(
            JointReading(k * 0.03, (0.0, -0.186, 0.0, -1.837, 0.0, 1.651, math.pi / 4))
        )
    state = robot_world.measure(0.0)
    block = state.layout.object("block1")
    assert state[block][:3] == pytest.approx((0.5, 0.2, 0.1))
    assert [atom.predicate.name for atom in DOMAIN.default_goal(state)] == ["On"]


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("objects:", "things:", "no mapping `objects`"),
        ("type: block", "type: cow", "unknown type 'cow'"),
        ("frame: tag36h11:1", "frmae: tag36h11:1", "unknown keys"),
        ("frame: tag36h11:1", "pose: [0, 0, 0, 0, 0, 0, 1]", "what can move needs a frame"),
        ("mass: 0.5, ", "", "features"),
        ("0, 0, 0, 1]\n    features: {half_x: 0.026", "0, 0, 0, 7]\n    features: {half_x: 0.026",
         "length 7"),
    ],
)  # fmt: skip
def test_a_scene_file_with_a_mistake_is_refused(tmp_path, before, after, words):
    assert before in SCENE
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.replace(before, after))
    with pytest.raises(InvalidSceneError, match=words):
        read_scene_config(path, DOMAIN)


def test_a_scene_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InvalidSceneError, match="cannot be read"):
        read_scene_config(tmp_path / "none.yaml", DOMAIN)


def test_a_detection_in_another_unit_is_refused():
    bench = Bench()
    bench.now = 1.0
    in_mm = Pose((450.0, 0.0, 20.0), IDENTITY.quaternion)
    with pytest.raises(InvalidMeasurementError, match=r"block1 is detected 450\.\d+ m away"):
        bench.robot_world.add_detection("detected_block1", 1.0, IDENTITY, in_mm)


def test_an_arm_that_is_measured_a_little_beyond_a_limit_stands_at_it():
    low, high = list(JOINT_LOW), list(JOINT_HIGH)
    measured = [low[0] - 0.001, high[1] + 0.019, *HOME[2:]]
    assert possible_joints(measured) == [low[0], high[1], *HOME[2:]]
    far = [low[0] - 0.03, *HOME[1:]]
    assert possible_joints(far) == far
    assert possible_joints(HOME) == list(HOME)
