# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded plan on a robot that is not there: checked, refused, executed, stopped."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import rclpy

from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.bags import read_bag
from slap_ros.bags.writer import BagWriter
from slap_ros.errors import DamagedBagError, InvalidParameterError, UnsafeCommandError
from slap_ros.messages.typestore import typestore
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.limits import FR3, PANDA, Limits, Workspace
from slap_ros.robot.recorded_motion import read_recorded_motion
from slap_ros.skills.domain_choice import DomainChoice
from support.slap_command import slap

QUICK = "pace=20,rate=200,latency=0.01"
PATIENT = "joint_timeout=60,controller_timeout=60,start_timeout=60"
HALF = PANDA.scaled(0.5, Workspace())


@pytest.fixture(scope="module")
def bag(tmp_path_factory, module_network):
    """A run of Obstacle Tower with the shipped shortcuts. Shared: not to be changed."""
    folder = tmp_path_factory.mktemp("replay") / "bag"
    settings = RunSettings(
        DomainChoice("obstacle_tower", "fair"), 1, 0, "lazy", folder, patience=5.0
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(module_network))
        metrics = run(RunRequest(settings, timeout_s=200, in_process=True), lambda *_: None)
    assert metrics.success
    return folder


def replay(*arguments):
    """Exit code, stdout and stderr."""
    result = slap("bag", "replay", *arguments)
    return result.exit_code, result.stdout, " ".join(result.stderr.split())


def replay_alone(*arguments):
    """The same, in a process of its own: a mock robot writes to a real stderr."""
    command = [sys.executable, "-m", "ensemble.cli", "bag", "replay", *map(str, arguments)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=200)
    return ran.returncode, ran.stdout, " ".join(ran.stderr.split())


def recorded_joints(bag):
    """Joint positions of each state, read from the joint states that were published."""
    return [
        list(message.position)
        for _, kind, _, message in read_bag(bag)
        if kind == "sensor_msgs/msg/JointState"
    ]


def test_waypoints_are_where_the_arm_was_and_what_the_gripper_did(bag):
    recorded = read_recorded_motion(bag)
    arm = recorded_joints(bag)
    np.testing.assert_array_equal(arm, [recorded.start, *(w.joints for w in recorded.waypoints)])
    assert [w.step for w in recorded.waypoints] == list(range(1, len(arm)))
    grips = [w.gripper for w in recorded.waypoints if w.gripper is not GripperAction.KEEP]
    assert grips == [GripperAction.CLOSE, GripperAction.OPEN]
    gaps = [w.gap for w in recorded.waypoints if w.gap]
    assert gaps
    assert gaps == pytest.approx([0.05] * len(gaps), abs=1e-3)


def test_every_motion_of_a_dry_run_keeps_the_limits(bag):
    """Velocity and acceleration by finite differences of the quintic that a controller runs."""
    recorded = read_recorded_motion(bag)
    found = DryRun.of(recorded, HALF)
    assert len(found.motions) == len(recorded.waypoints)
    assert not found.violations
    s = np.linspace(0.0, 1.0, 401)
    course = 10 * s**3 - 15 * s**4 + 6 * s**5
    fastest, hardest = np.zeros(7), np.zeros(7)
    for motion in found.motions:
        way = np.outer(course, np.subtract(motion.target, motion.start))
        dt = motion.duration_s / 400
        velocity = np.abs(np.diff(way, axis=0)).max(axis=0) / dt
        acceleration = np.abs(np.diff(way, 2, axis=0)).max(axis=0) / dt**2
        assert (velocity <= np.array(HALF.velocity) + 1e-6).all()
        assert (acceleration <= np.array(HALF.acceleration) * 1.001).all()
        fastest, hardest = np.maximum(fastest, velocity), np.maximum(hardest, acceleration)
    shares = {re.sub(r" of joint \d", "", e.quantity): e.share for e in found.extremes}
    assert shares["velocity"] == pytest.approx((fastest / HALF.velocity).max(), rel=1e-2)
    assert shares["acceleration"] == pytest.approx((hardest / HALF.acceleration).max(), rel=1e-2)
    assert found.duration_s > len(recorded.waypoints) * recorded.domain.execution.control_period_s


def test_the_fastest_step_is_the_one_in_which_the_arm_moves_not_one_in_which_it_stands_there(bag):
    recorded = read_recorded_motion(bag)
    first = next(w for w in recorded.waypoints if w.joints != recorded.start)
    stands = [replace(first, step=step) for step in (1, 2, 3)]
    found = DryRun.of(replace(recorded, waypoints=tuple(stands)), HALF)
    steps = {e.quantity.split()[0]: e.step for e in found.extremes}
    assert (steps["velocity"], steps["acceleration"]) == (1, 1)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (replace(PANDA, workspace=Workspace(low=(0.2, -0.5, 0.2))), "outside the workspace"),
        (replace(PANDA, high=(0.1, *PANDA.high[1:])), r"joint 1 would go to \d\.\d+ rad, beyond"),
        (replace(PANDA, step=(0.01,) * 7), "in one command"),
    ],
)
def test_what_goes_too_far_is_named_with_its_step(bag, limits: Limits, words):
    found = DryRun.of(read_recorded_motion(bag), limits)
    assert found.violations
    assert any(extreme.share > 1.0 for extreme in found.extremes)
    assert all(re.search(words, reason) for _, reason in found.violations)
    with pytest.raises(UnsafeCommandError, match=f"step {found.violations[0][0]} of the recording"):
        found.require_safe()


def test_a_slower_arm_takes_longer_and_has_its_own_limits(bag):
    recorded = read_recorded_motion(bag)
    slow, fast = (DryRun.of(recorded, FR3.scaled(f, Workspace())) for f in (0.1, 1.0))
    assert not slow.violations
    assert slow.duration_s > 2.0 * fast.duration_s


def test_a_dry_run_says_all_of_it_and_moves_nothing(bag):
    code, out, told = replay(bag, "--to", "robot", "--dry-run", "--json")
    assert code == 0, told
    data = json.loads(out)
    assert data["steps"] == len(recorded_joints(bag)) - 1
    assert data["violations"] == []
    code, out, _ = replay(
        bag, "--to", "robot", "--dry-run", "--robot", "workspace=.2 -.5 .2 .8 .5 .9"
    )
    assert code == 72
    assert "steps beyond its limits" in out
    assert "outside the workspace" in out


def test_nothing_moves_unless_somebody_says_so(bag):
    code, _, told = replay(bag, "--to", "robot")
    assert code == 34
    assert "nothing moved" in told


@pytest.mark.slow
def test_the_mock_robot_does_what_was_recorded(network, bag):
    code, out, told = replay_alone(
        bag, "--to", "mock", "--mock", QUICK, "--robot", PATIENT, "--json"
    )
    assert code == 0, told
    data = json.loads(out)
    assert data["played"] == data["steps"]
    assert data["reached"] is True
    assert "the goal holds" in told


@pytest.mark.slow
def test_another_start_is_refused(network, bag, tmp_path):
    """The same recording from a moment later: neither arm nor blocks are there."""
    late = tmp_path / "late"
    cut(bag, late, first=6)
    code, _, told = replay_alone(late, "--to", "mock", "--mock", QUICK, "--robot", PATIENT)
    assert code == 95
    assert "rad off where the recording begins" in told


@pytest.mark.slow
def test_a_controller_that_fails_ends_the_replay(network, bag):
    mock = f"{QUICK},fault=abort,fault_after=3"
    code, _, told = replay_alone(bag, "--to", "mock", "--mock", mock, "--robot", PATIENT)
    assert code == 74, told
    assert "steps executed" not in told


@pytest.mark.slow
def test_an_object_that_is_not_there_is_named_before_anything_moves(network, bag):
    mock = f"{QUICK},hidden=block2"
    settings = "joint_timeout=60,controller_timeout=60,start_timeout=8"
    code, _, told = replay_alone(bag, "--to", "mock", "--mock", mock, "--robot", settings)
    assert code == 77
    assert "not detected at the start: block2" in told


def test_a_robot_that_a_bridge_commands_is_left_alone(network, bag):
    rclpy.init()
    bridge = rclpy.create_node("robot_bridge")
    try:
        code, _, told = replay_alone(bag, "--to", "robot", "--yes")
    finally:
        bridge.destroy_node()
        rclpy.shutdown()
    assert code == 113
    assert "stop it first" in told


def test_half_a_recording_is_not_executed(bag, tmp_path):
    holed = tmp_path / "holed"
    cut(bag, holed, without=5)
    with pytest.raises(DamagedBagError, match="state of step 5 is not in the bag"):
        read_recorded_motion(holed)


def test_a_recording_that_begins_with_something_in_the_hand_is_refused(bag, tmp_path):
    grasped = next(
        w.step for w in read_recorded_motion(bag).waypoints if w.gripper is GripperAction.CLOSE
    )
    cut(bag, tmp_path / "held", first=grasped)
    with pytest.raises(InvalidParameterError, match="in the hand"):
        read_recorded_motion(tmp_path / "held")


def test_a_domain_without_an_arm_is_refused(network, tmp_path):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        3,
        0,
        "lazy",
        tmp_path / "bag",
        shortcuts="none",
        patience=5.0,
    )
    run(RunRequest(settings, timeout_s=200, in_process=True), lambda *_: None)
    with pytest.raises(InvalidParameterError, match="no Panda"):
        read_recorded_motion(tmp_path / "bag")


def test_options_for_a_robot_are_refused_elsewhere(bag):
    for wrong in (["--dry-run"], ["--to", "moon"], ["--to", "robot", "--mock", "pace=2"]):
        code, _, told = replay(bag, *wrong)
        assert code == 15, told


def cut(source, target, first=0, without=None):
    """The same bag with the states from one on, counted again, or without one."""
    with BagWriter(target, {}) as writer:
        for topic, kind, stamp, message in read_bag(source):
            if kind == "slap_msgs/msg/ObjectCentricState":
                if message.step < first or message.step == without:
                    continue
                message.step -= first
            writer.write(topic, kind, stamp, typestore().serialize_cdr(message, kind))
