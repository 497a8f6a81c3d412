# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A camera at a bench: tags on what moves there, and states from pictures, seen or hidden."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.make_coffee.scenery import holder
from slap_ros.domains.stow_hammer.scenery import SHAPE, hammer
from slap_ros.errors import InvalidSceneError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.servoed_robot import ServoedRobot
from slap_ros.robot.tag_places import tag_places
from slap_ros.robot.tagged_scene import tagged_scene
from slap_ros.robot.tracking import TrackingSettings
from slap_ros.vision.tags import SHARE_OF_FACE
from slap_ros.worlds.bodies import WOOD
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.scene import BoxPart
from slap_ros.worlds.features import pose_features, pose_of

pytest.importorskip("mujoco")
pytest.importorskip("pupil_apriltags")

from slap_ros.robot.mujoco.detectors import CameraSettings, TagCameraDetector, camera_beside
from slap_ros.robot.mujoco.plant_controllers import REACH
from slap_ros.vision.pinhole_camera import PinholeCamera, looking_at

SEED = 300
HIDDEN_AFTER = 5
BY_CAMERA = TrackingSettings(0.0005, 0.005, hidden_after=HIDDEN_AFTER)
PICTURE_S = 0.05
# It looks at the fronts of drawers, past the arm.
AT_FRONTS = CameraSettings(
    PinholeCamera.centred(1920, 1080, 1600.0), looking_at((-0.2, 0.5, 0.6), (0.5, -0.03, 0.03))
)
CLOSED_ON_CUBE = 0.04  # m, between fingers that press on a cube
OPEN = 0.08  # m


@dataclass
class SeenBench:
    """A task's first picture, and a robot that measures by it."""

    poses: dict  # of what moves, as the physics has them
    openings: dict
    found: list  # of one picture
    config: object
    robot: ServoedRobot
    now_s: float = 0.0

    def look(self, without=()):
        """Take a picture again, which does not show some objects."""
        self.now_s += PICTURE_S
        hidden = {
            how.frame
            for obj, frames in self.config.detected.items()
            if obj.name in without
            for how in frames
        }
        for seen in self.found:
            if seen.frame not in hidden:
                self.robot.add_detection(seen.frame, self.now_s, seen.base, seen.seen)
        self.robot.add_picture(self.now_s)

    def hold(self, hand, gap):
        """Have the arm stand with its hand at a pose, for some readings."""
        joints = arm_joints(hand)
        for _ in range(4):
            self.now_s += 0.01
            reading = JointReading(self.now_s, joints, (0.0,) * 7, gap)
            self.robot.add_joint_reading(reading)


def seen_bench(name, camera, opening=None, inside=None):
    domain = get_domain(name, "fair:hand=panda")
    initial = domain.task(SEED).initial_state
    if opening is not None:
        obj, value = initial.layout.object(opening[0]), opening[1]
        initial = initial.replace({(obj, "opening"): value})
    for thing, (cabinet, at) in (inside or {}).items():
        obj = initial.layout.object(thing)
        frame = pose_of(initial, initial.layout.object(cabinet))
        part = frame.compose(Pose((0.0, opening[1], 0.0)))
        features = pose_features(part.compose(at))
        initial = initial.replace({(obj, name): value for name, value in features.items()})
    detector = TagCameraDetector(domain, initial, camera)
    try:
        found = detector.detect()
    finally:
        detector.close()
    robot = ServoedRobot(domain, detector.config, REACH, BY_CAMERA)
    plant = detector.plant
    return SeenBench(plant.poses(), plant.openings(), found, detector.config, robot)


@pytest.fixture(scope="module")
def picture():
    """The first picture of a task of Stack at Target."""
    return seen_bench("stack_at_target", camera_beside())


@pytest.fixture
def stack(picture):
    """A robot before that picture that has measured nothing yet."""
    domain = get_domain("stack_at_target", "fair:hand=panda")
    return replace(picture, robot=ServoedRobot(domain, picture.config, REACH, BY_CAMERA))


def begun(bench, hand):
    for _ in range(4):
        bench.look()
        bench.hold(hand, OPEN)
    state = bench.robot.begin(0.0)
    assert state is not None
    return state


ABOVE = hand_at((0.45, 0.0, 0.25)).pose


def test_cubes_are_where_their_tags_in_a_picture_say(stack):
    state = begun(stack, ABOVE)
    for name in ("cube0", "cube1"):
        measured, true = pose_of(state, state.layout.object(name)), stack.poses[name]
        assert math.dist(measured.position, true.position) < 1e-3
        assert measured.angle_to(true) < 0.02
    assert not stack.robot.hidden


def test_hammers_and_drawers_are_where_their_tags_in_a_picture_say():
    bench = seen_bench("stow_hammer", AT_FRONTS, ("cabinet1", 0.1))
    assert bench.openings["cabinet1"].position == pytest.approx(0.1, abs=1e-3)
    state = begun(bench, hand_at((0.45, 0.0, 0.25), 0.5 * math.pi).pose)
    for name in ("hammer0", "hammer1"):
        measured, true = pose_of(state, state.layout.object(name)), bench.poses[name]
        assert math.dist(measured.position, true.position) < 3e-3
        assert measured.angle_to(true) < 0.03
    for name, true in bench.openings.items():
        opening = float(state.get(state.layout.object(name), "opening"))
        assert opening == pytest.approx(true.position, abs=2e-3)


def test_what_pictures_no_longer_show_is_hidden_and_where_it_was(stack):
    before = begun(stack, ABOVE)
    for number in range(HIDDEN_AFTER + 1):
        assert stack.robot.hidden == (["cube0"] if number == HIDDEN_AFTER else [])
        stack.look(without=("cube0",))
        stack.hold(ABOVE, OPEN)
    assert stack.robot.hidden == ["cube0"]
    assert not stack.robot.undetected(stack.now_s - PICTURE_S * HIDDEN_AFTER)
    after = stack.robot.measure(0.0)
    cube = after.layout.object("cube0")
    was = pose_of(before, cube).position
    assert pose_of(after, cube).position == pytest.approx(was, abs=1e-9)
    assert float(after.get(cube, "vx")) == 0.0
    stack.look()
    assert not stack.robot.hidden


def test_what_a_roof_hides_has_gone_with_its_drawer():
    """The front is seen to move in, and the hammer in the drawer is not seen any more."""
    inside = {"hammer0": ("cabinet1", Pose((0.0, -0.07, 0.052)))}
    bench = seen_bench("stow_hammer", AT_FRONTS, ("cabinet1", 0.15), inside)
    state = begun(bench, hand_at((0.45, 0.0, 0.25), 0.5 * math.pi).pose)
    before = pose_of(state, state.layout.object("hammer0")).position
    assert math.dist(before, bench.poses["hammer0"].position) < 3e-3
    shut = seen_bench("stow_hammer", AT_FRONTS, ("cabinet1", 0.01))
    bench.found = shut.found
    for _ in range(HIDDEN_AFTER + 1):
        bench.look(without=("hammer0",))
        bench.hold(hand_at((0.45, 0.0, 0.25), 0.5 * math.pi).pose, OPEN)
    state = bench.robot.measure(0.0)
    assert bench.robot.hidden == ["hammer0"]
    after = pose_of(state, state.layout.object("hammer0")).position
    moved = [a.position for a in (shut.poses["cabinet1_moving"], bench.poses["cabinet1_moving"])]
    way = np.subtract(*moved)
    assert math.hypot(*way) == pytest.approx(0.14, abs=2e-3)
    assert np.subtract(after, before) == pytest.approx(way, abs=3e-3)


def test_what_no_picture_has_shown_is_not_hidden_but_missing(stack):
    for _ in range(2 * HIDDEN_AFTER):
        stack.look(without=("cube1",))
        stack.hold(ABOVE, OPEN)
    assert stack.robot.begin(0.0) is None
    assert stack.robot.undetected(0.0) == stack.robot.never_shown == ["cube1"]


def test_what_the_hand_covers_goes_with_it_and_stays_where_it_is_let_go(stack):
    """It was seen last before the fingers closed, when the hand was above it."""
    begun(stack, ABOVE)
    cube = stack.poses["cube0"]
    x, y, z = cube.position
    grasp = hand_at((x, y, z), _yaw(cube)).pose
    lifted = hand_at((x + 0.03, y, z + 0.1), _yaw(cube)).pose
    covered = {"without": ("cube0",)}
    for _ in range(HIDDEN_AFTER + 1):
        stack.look(**covered)
        stack.hold(grasp, OPEN)
    stack.robot.plan_command(np.array([0.0, 0.0, 0.0, 0.0, 1.0]))
    stack.hold(grasp, CLOSED_ON_CUBE)
    assert _held(stack.robot.measure(0.0)) == ["cube0"]
    stack.look(**covered)
    stack.hold(lifted, CLOSED_ON_CUBE)
    state = stack.robot.measure(0.0)
    assert _held(state) == ["cube0"]
    raised = (x + 0.03, y, z + 0.1)
    at = pose_of(state, state.layout.object("cube0")).position
    assert at == pytest.approx(raised, abs=2e-3)
    stack.robot.plan_command(np.array([0.0, 0.0, 0.0, 0.0, -1.0]))
    for _ in range(3):
        stack.look(**covered)
        stack.hold(ABOVE, OPEN)
        state = stack.robot.measure(0.0)
    assert _held(state) == []
    stays = pose_of(state, state.layout.object("cube0")).position
    assert stays == pytest.approx(raised, abs=2e-3)


def _yaw(pose):
    """The yaw of a hand that is along a cube."""
    x, y, z, w = pose.quaternion
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return math.remainder(yaw, 0.5 * math.pi)


def _held(state):
    things = [obj for obj in state.objects if "held" in obj.type.column]
    return [obj.name for obj in things if state.get(obj, "held") > 0.5]


BODIES = {
    "block": (BoxPart((0.025, 0.025, 0.025)),),
    "hammer": hammer("hammer", WOOD).parts,
    "drawer": SHAPE.body("cabinet", WOOD).moving,
    "lid": holder("holder").moving,
}


@pytest.mark.parametrize("name", BODIES)
def test_tags_lie_flat_on_faces_and_nothing_is_before_or_over_them(name):
    places = tag_places(BODIES[name])
    edge = 0.5 * places.size / SHARE_OF_FACE - 1e-6
    boxes = [part.bounding_box for part in BODIES[name]]
    assert places.poses
    for pose in places.poses:
        corners = [pose.apply((x, y, 0.0)) for x in (-edge, edge) for y in (-edge, edge)]
        assert any(all(_touches(box, corner) for corner in corners) for box in boxes)
        before = OrientedBox(pose.compose(Pose((0.0, 0.0, 5e-4))), (edge - 1e-3, edge - 1e-3, 1e-4))
        assert not any(before.overlaps(box) for box in boxes)
    plates = [OrientedBox(pose, (edge - 1e-3, edge - 1e-3, 1e-5)) for pose in places.poses]
    assert not any(a.overlaps(b) for i, a in enumerate(plates) for b in plates[:i])


def _touches(box, point):
    """Whether a point is on the surface of a box, margins for rounding left out."""
    inside = box.pose.inverse().apply(point)
    gaps = [half - abs(value) for half, value in zip(box.half, inside, strict=True)]
    return min(gaps) == pytest.approx(0.0, abs=1e-6)


def test_what_is_too_small_for_a_tag_that_a_camera_sees_is_named():
    """Of a peg, only the ends are flat."""
    domain = get_domain("peg_in_hole")
    with pytest.raises(InvalidSceneError, match=r"peg1 is too small .* 13\.5 mm .* needs 15 mm"):
        tagged_scene(domain, domain.task(SEED).initial_state)


def test_a_drawers_front_has_tags_beside_its_handle():
    places = tag_places(BODIES["drawer"])
    assert places.size == pytest.approx(0.0205)  # m: the front is 26 mm high
    front = [p for p in places.poses if p.apply((0.0, 0.0, 1.0))[1] - p.position[1] > 0.99]
    assert {round(p.position[1], 6) for p in front} == {0.0}
    assert min(p.position[0] for p in front) < -0.04 and max(p.position[0] for p in front) > 0.04
