# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States at a bench from encoders and late detections, while the arm moves."""

import math
from dataclasses import replace

import numpy as np
import pytest
import yaml

from slap_ros.domains import get_domain
from slap_ros.errors import (
    InvalidCommandError,
    InvalidMeasurementError,
    InvalidParameterError,
    InvalidSceneError,
    InvalidStateError,
    UnsafeCommandError,
)
from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import make_planner
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.limits import Workspace
from slap_ros.robot.scene_config import DetectedFrame, sampled_scene_config, scene_config
from slap_ros.robot.servoed_robot import ServoedRobot, require_servoed
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.clearing import DEEPEST
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand import PAD, hand_at
from slap_ros.worlds.contact.validation import OVERLAP
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.panda import FINGER_OPEN

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")

from slap_ros.robot.mujoco.model import scene_around
from slap_ros.robot.mujoco.plant import PERIOD_S, MujocoPlant
from slap_ros.robot.mujoco.plant_controllers import REACH, UNCHECKED, PlantControllers

SEED = 300
RATE_S, LATE_S, JOINTS_S = 1 / 30, 0.02, 0.01  # as of the node in MuJoCo
EXACT = TrackingSettings(position_noise_m=0.0005, turn_noise_rad=0.005)
TIPS = PAD.pose.position[2] + PAD.half_extents_m[2]  # m, below the grasp point
DOWN = np.array([0.0, 0.0, -0.02, 0.0, 0.0])


@pytest.fixture(scope="module")
def domain():
    """Stack at Target with the demonstrator's scripts, whose states are measured."""
    return open_domain(DomainChoice("stack_at_target", skills=DEMONSTRATOR, measured=True))


class MeasuredPlant:
    """A plant that is measured as the nodes do it: joints at 100 Hz, things at 30 Hz and late."""

    def __init__(self, domain, workspace=REACH, pace=1.0):
        initial = domain.task(SEED).initial_state
        self.plant, self.pace = MujocoPlant.of(domain, initial), pace
        scene = scene_around(domain, initial)
        self.robot = ServoedRobot(domain, sampled_scene_config(initial), workspace, EXACT, pace)
        self._controllers = PlantControllers(self.plant, UNCHECKED, scene.hand.grip_n, self._watch)
        self._joints_s = self._seen_s = -1.0
        self._pending = []
        began_s = self.now_s
        while (state := self.robot.begin(began_s)) is None:
            self._controllers.pass_period()
        self.state = state

    @property
    def now_s(self):
        """Time on the clock by which measurements are stamped."""
        return self.plant.time_s / self.pace

    def reset(self, state):
        raise NotImplementedError

    def step(self, action):
        command = self.robot.plan_command(action)
        if (gap := command.gripper.gap) is not None:
            self._controllers.command_fingers(gap)
        self._controllers.replace_motion(command.points)
        for _ in range(round(0.05 / PERIOD_S)):
            self._controllers.pass_period()
        self.state = self.robot.measure(-math.inf)
        return self.state

    def _watch(self):
        plant, now_s = self.plant, self.plant.time_s
        if now_s - self._joints_s >= JOINTS_S - 1e-9:
            self._joints_s = now_s
            joints, speeds = tuple(plant.joints), tuple(plant.joint_velocities)
            self.robot.add_joint_reading(JointReading(self.now_s, joints, speeds, plant.gap))
        if now_s - self._seen_s >= RATE_S - 1e-9:
            self._seen_s = now_s
            self._pending.append((now_s + LATE_S, self.now_s, plant.poses()))
        while self._pending and self._pending[0][0] <= now_s:
            _, stamp_s, poses = self._pending.pop(0)
            for name, pose in poses.items():
                self.robot.add_detection(f"detected_{name}", stamp_s, IDENTITY, pose)


@pytest.fixture(scope="module")
def run(domain):
    """Two cubes stacked by what was measured, and how far off each state was from the plant."""
    world, off, held = MeasuredPlant(domain), [], []
    step = world.step

    def compared(action):
        state = step(action)
        named = [o for o in state.objects if "held" in o.type.column]
        carried = [o.name for o in named if state.get(o, "held") > 0.5]
        held.append(([world.plant.grasped()] if world.plant.grasped() else [], carried))
        for obj in named:
            if obj.name in carried:
                at = [float(state.get(obj, axis)) for axis in "xyz"]
                off.append(math.dist(at, world.plant.poses()[obj.name].position))
        return state

    world.step = compared
    task, space = domain.task(SEED), domain.atom_space(world.state)
    goal = space.mask(task.goal)
    planner = make_planner("lazy", domain, world.state)
    episode = Executor(domain, planner, world, space, goal, task.step_limit).run()
    return episode, off, held, world


def test_a_stack_is_built_by_late_detections(run, domain):
    episode, _, _, world = run
    assert episode.success, episode.error
    on, under = (world.plant.poses()[name].position for name in ("cube1", "cube0"))
    assert on[:2] == pytest.approx(under[:2], abs=0.01)
    assert on[2] - under[2] == pytest.approx(0.04, abs=0.002)


def test_what_is_held_is_where_the_hand_has_it_though_detections_are_old(run):
    """A hand at 0.3 m/s goes 16 mm while a detection is due and late."""
    _, off, _, _ = run
    assert len(off) > 40
    assert max(off) < 0.006
    assert sorted(off)[len(off) // 2] < 0.002


def test_what_both_fingers_press_on_is_held_and_nothing_else(run):
    _, _, held, _ = run
    differ = sum(pressed != carried for pressed, carried in held)
    assert differ <= 6  # steps in which fingers meet a cube, or let go of it
    assert {tuple(carried) for _, carried in held} == {(), ("cube0",), ("cube1",)}


def test_a_thing_has_the_velocity_of_its_last_detections(domain):
    world = MeasuredPlant(domain)
    robot, state = world.robot, world.state
    cube = state.layout.object("cube0")
    assert [float(state.get(cube, f"v{axis}")) for axis in "xyz"] == [0.0, 0.0, 0.0]
    at, stamp_s = world.plant.poses()["cube0"], world.now_s
    x, y, z = at.position
    for i in range(1, 4):
        seen = Pose((x, y - 0.01 * i, z), at.quaternion)
        robot.add_detection("detected_cube0", stamp_s + 0.1 * i, IDENTITY, seen)
    moved = robot.measure(-math.inf)
    velocity = [float(moved.get(cube, f"v{axis}")) for axis in "xyz"]
    assert velocity == pytest.approx([0.0, -0.1, 0.0])
    assert float(moved.get(cube, "y")) == pytest.approx(y - 0.03)


def test_things_inside_one_another_are_no_state_and_a_hand_inside_one_is_where_encoders_say(domain):
    """Real fingers are narrower than the planner's: a skill goes on, but no task begins there."""
    world = MeasuredPlant(domain)
    robot, began_s = world.robot, world.now_s
    (hand,) = world.state.layout.of_type(ROBOT)
    x, y, z = (float(world.state.get(hand, axis)) for axis in "xyz")
    other = world.plant.poses()["cube1"]

    def seen_at(pose, after_s):
        for i in range(1, 4):
            for name, at in (("cube0", pose), ("cube1", other)):
                robot.add_detection(f"detected_{name}", began_s + after_s + i, IDENTITY, at)

    seen_at(Pose((x, y, z + 0.1)), 0.0)
    state = robot.measure(-math.inf)
    assert float(state.get(state.layout.object("cube0"), "z")) == pytest.approx(z + 0.1)
    with pytest.raises(InvalidStateError, match="the hand and cube0 are inside one another"):
        robot.begin(-math.inf)
    seen_at(other, 3.0)
    with pytest.raises(InvalidStateError, match="cube1 and cube0 are inside one another"):
        robot.measure(-math.inf)


def test_time_that_passes_faster_is_taken_into_account(domain):
    velocities = []
    for pace in (1.0, 5.0):
        world = MeasuredPlant(domain, pace=pace)
        for _ in range(4):
            world.step(-DOWN)
        (robot,) = world.state.layout.of_type(ROBOT)
        velocities.append(float(world.state.get(robot, "vz")))
        assert world.robot.newest_joints_s == pytest.approx(world.now_s, abs=0.011)
    assert velocities[0] == pytest.approx(velocities[1])
    assert velocities[0] > 0.1


def test_what_is_unsafe_is_refused_and_commands_nothing(domain):
    world = MeasuredPlant(domain, Workspace((0.2, -0.5, 0.15), (0.8, 0.5, 0.9)))
    lowest = 1.0
    with pytest.raises(UnsafeCommandError, match=r"z = 0\.1"):
        for _ in range(50):
            world.step(DOWN)
            (robot,) = world.state.layout.of_type(ROBOT)
            lowest = float(world.state.get(robot, "target_z"))
    assert lowest >= 0.15 - 1e-9
    with pytest.raises(InvalidCommandError):
        world.robot.plan_command(10.0 * DOWN)
    (robot,) = world.robot.measure(-math.inf).layout.of_type(ROBOT)
    assert float(world.robot.measure(-math.inf).get(robot, "target_z")) == lowest


def test_what_is_not_measured_gives_no_state(domain):
    initial = domain.task(SEED).initial_state
    robot = ServoedRobot(domain, sampled_scene_config(initial), REACH, EXACT)
    plant = MujocoPlant.of(domain, initial)
    assert robot.begin(0.0) is None
    assert robot.undetected(0.0) == ["cube0", "cube1"]
    for i in range(1, 5):
        for name, pose in plant.poses().items():
            robot.add_detection(f"detected_{name}", 0.1 * i, IDENTITY, pose)
        moving = (0.3,) * 7
        reading = JointReading(0.1 * i, tuple(plant.joints), moving, plant.gap)
        robot.add_joint_reading(reading)
    assert robot.begin(0.0) is None  # the arm moves
    with pytest.raises(InvalidStateError, match="nothing is measured"):
        robot.plan_command(DOWN)
    with pytest.raises(InvalidMeasurementError, match="not newer"):
        robot.add_joint_reading(reading)
    with pytest.raises(InvalidMeasurementError, match="are positions in m"):
        robot.add_detection("detected_cube0", 1.0, IDENTITY, Pose((500.0, 0.0, 20.0)))


def test_a_hand_that_plans_can_be_cleared_of_a_table_is_measured(domain):
    """Fingers are in it by the planner's shapes. Much deeper, joints are measured wrongly."""
    initial = domain.task(SEED).initial_state
    for depth in (0.5 * (OVERLAP + DEEPEST), 1.1 * DEEPEST):
        robot = ServoedRobot(domain, sampled_scene_config(initial), REACH, EXACT)
        joints = arm_joints(hand_at((0.45, 0.0, TIPS - depth)).pose)
        for i in range(1, 5):
            for name, pose in MujocoPlant.of(domain, initial).poses().items():
                robot.add_detection(f"detected_{name}", 0.1 * i, IDENTITY, pose)
            robot.add_joint_reading(JointReading(0.1 * i, joints, (0.0,) * 7, 2.0 * FINGER_OPEN))
        if depth < DEEPEST:
            state = robot.begin(0.0)
            (hand,) = state.layout.of_type(ROBOT)
            assert state.get(hand, "z") == pytest.approx(TIPS - depth)  # as it is measured
        else:
            with pytest.raises(InvalidStateError, match="the hand and table are inside"):
                robot.begin(0.0)


def test_a_drawer_is_as_far_open_as_its_front_is_seen():
    """Nothing but detections says so: the state that the task began in has both shut."""
    world = MeasuredPlant(get_domain("stow_hammer"))
    pulled, other = (world.state.layout.object(f"cabinet{i}") for i in range(2))
    axis = world.plant._data.xaxis[world.plant._model.joint("cabinet0").id]
    front = world.plant._model.body("cabinet0_moving").id
    world.plant._data.xfrc_applied[front][:3] = 11.0 * axis  # N, little more than its friction
    rates = []
    for _ in range(16):
        state, true = world.step(np.zeros(5)), world.plant.openings()["cabinet0"]
        late = 0.1 * abs(true.velocity) + 1e-3  # m: of two periods of detections, and their delay
        assert float(state.get(pulled, "opening")) == pytest.approx(true.position, abs=late)
        assert state.get(other, "opening") == pytest.approx(0.0, abs=1e-6)
        rates.append((float(state.get(pulled, "opening_velocity")), true.velocity))
    assert float(state.get(pulled, "opening")) > 0.05
    fastest = max(rates, key=lambda pair: pair[0])
    assert fastest[0] > 0.1 and fastest[0] == pytest.approx(fastest[1], rel=0.2)
    world.plant._data.xfrc_applied[front][:3] = 0.0
    for _ in range(6):
        state = world.step(np.zeros(5))
    assert float(state.get(pulled, "opening_velocity")) == 0.0
    at_rest = world.plant.openings()["cabinet0"].position
    assert float(state.get(pulled, "opening")) == pytest.approx(at_rest, abs=1e-6)


def test_a_front_that_is_seen_elsewhere_is_refused_and_named():
    """As where somebody has put the tag of one drawer on the other."""
    domain = get_domain("stow_hammer")
    initial = domain.task(SEED).initial_state
    robot = ServoedRobot(domain, sampled_scene_config(initial), REACH, EXACT)
    poses = MujocoPlant.of(domain, initial).poses()
    swapped = {"cabinet0_moving": "cabinet1_moving"}
    for name in poses:
        seen = poses[swapped.get(name, name)]
        if name in swapped:
            with pytest.raises(InvalidMeasurementError, match=r"cabinet0 .* another thing"):
                robot.add_detection(f"detected_{name}", 1.0, IDENTITY, seen)
        else:
            robot.add_detection(f"detected_{name}", 1.0, IDENTITY, seen)
    (missing,) = robot.undetected(0.0)
    assert missing.startswith("cabinet0 (") and "away from where its joint" in missing
    robot.add_detection("detected_cabinet0_moving", 1.1, IDENTITY, poses["cabinet0_moving"])
    assert not robot.undetected(0.0)


COFFEE = """
objects:
  pod:
    type: pod
    frame: tag36h11:1
    offset: [0, 0, -0.025]
    features: {support_height: 0.025, rest_height: 0.025}
  cabinet:
    type: cabinet
    pose: [0.45, 0.35, 0, 0, 0, 0.707107, 0.707107]
    frames: {tag36h11:2: [0, -0.045, 0, 0, 0.707107, 0.707107, 0]}
    features: {support_height: 0.04}
  holder:
    type: holder
    pose: [0.5, -0.1, 0, 0, 0, 0, 1]
    frame: tag36h11:3
    offset: [0.055, 0, -0.004]
    features: {support_height: 0.01}
"""
COFFEE_DOMAIN = get_domain("make_coffee")
FRONT, LID = (0.0, 0.0, 0.045), (-0.055, 0.0, 0.004)  # m, of the tags in the frames of what opens


def test_a_scene_file_says_where_furniture_stands_and_tags_how_far_it_is_open():
    config = scene_config(yaml.safe_load(COFFEE), "here", COFFEE_DOMAIN)
    robot = ServoedRobot(COFFEE_DOMAIN, config, REACH, EXACT)
    upright = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)
    with COFFEE_DOMAIN.make_world(config.template) as world:
        scene = world.scene
    cabinet, holder = (jointed.joint for jointed in scene.jointed)
    frames = [
        pose_of(config.template, config.template.layout.object(b.name)) for b in scene.jointed
    ]
    front = frames[0].compose(cabinet.moved(0.1)).compose(Pose(FRONT, upright))
    lid = frames[1].compose(holder.moved(1.2)).compose(Pose(LID))
    seen = {1: Pose((0.4, 0.0, 0.05)), 2: front, 3: lid}
    joints = (0.0, -0.186, 0.0, -1.837, 0.0, 1.651, math.pi / 4)
    for i in range(1, 5):
        for tag, pose in seen.items():
            robot.add_detection(f"tag36h11:{tag}", 0.1 * i, IDENTITY, pose)
        robot.add_joint_reading(JointReading(0.1 * i, joints, (0.0,) * 7, 0.08))
    state = robot.begin(0.0)
    openings = [float(state.get(state.layout.object(n), "opening")) for n in ("cabinet", "holder")]
    assert openings == pytest.approx([0.1, 1.2], abs=1e-6)
    assert float(state.get(state.layout.object("pod"), "z")) == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("    pose: [0.5, -0.1, 0, 0, 0, 0, 1]\n", "", "what opens needs a pose"),
        (
            "    frame: tag36h11:3\n    offset: [0.055, 0, -0.004]\n",
            "",
            "either a frame, or several",
        ),
        ("frame: tag36h11:3", "frame: tag36h11:1", "each tag is on one object"),
    ],
)
def test_furniture_with_a_mistake_in_the_scene_file_is_refused(before, after, words):
    assert before in COFFEE
    with pytest.raises(InvalidSceneError, match=words):
        scene_config(yaml.safe_load(COFFEE.replace(before, after)), "here", COFFEE_DOMAIN)


def test_what_moves_and_is_not_detected_or_has_no_hand_is_named():
    drawers = get_domain("stow_hammer")
    config = sampled_scene_config(drawers.task(1).initial_state)
    for name, what in (("cabinet0", "how far it is open"), ("hammer1", "where it is")):
        seen = {obj: frames for obj, frames in config.detected.items() if obj.name != name}
        with pytest.raises(InvalidSceneError, match=rf"{name} needs .* else measures {what}"):
            require_servoed(drawers, replace(config, detected=seen))
    stack = get_domain("stack_at_target")
    config = sampled_scene_config(stack.task(1).initial_state)
    target = {config.template.layout.object("target0"): (DetectedFrame("tag36h11:9"),)}
    with pytest.raises(InvalidSceneError, match="target0 does not move: it needs a pose"):
        require_servoed(stack, replace(config, detected={**config.detected, **target}))
    tower = get_domain("obstacle_tower")
    scene = sampled_scene_config(tower.task(1).initial_state)
    with pytest.raises(InvalidParameterError, match="no hand that acts by forces"):
        ServoedRobot(tower, scene, REACH, EXACT)
