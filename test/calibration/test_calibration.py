# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Friction that is identified from pushes in a world whose friction the planner does not know."""

import json
from itertools import pairwise

import numpy as np
import pytest
import yaml

from slap_ros.bags.run_recording import record_run
from slap_ros.calibration.friction import identify_friction
from slap_ros.calibration.pushes import find_pushes, read_pushes
from slap_ros.domains import get_domain
from slap_ros.domains.tabletop.grasps import from_above
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.motion.inverse_kinematics import inverse_kinematics
from slap_ros.motion.joints import control_steps
from slap_ros.motion.linear import linear_motion, shifted
from slap_ros.planning.execution import EpisodeResult, PlanExecution
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import hold_option
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult
from slap_ros.relational import Target
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from support.slap_command import slap

PRESET = "fair:obstacles=1,distractors=0"
MODEL = get_domain("obstacle_tower", PRESET)  # what is planned with
NOMINAL = 0.9  # its friction
TRUE = 0.4
JOINTS = [f"joint{number}" for number in range(1, 8)]


def displacements(domain, moves):
    """Actions that displace the arm so, and then hold for half a second."""
    actions = np.zeros((len(moves) + 10, len(domain.action_space.axes)))
    actions[: len(moves), list(domain.action_space.displacement_indices)] = moves
    return list(actions)


def sweep(state, speed, depth=0.005):
    """Where the arm begins, and its moves in each step, to sweep a block to the left."""
    block, robot = (state.layout.by_name[name] for name in ("block1", "robot"))
    x, y, z = (float(state.get(block, axis)) for axis in "xyz")
    begin = from_above((x, y - 0.12, z - depth), 0.0)
    now = np.array([float(state.get(robot, name)) for name in JOINTS])
    path = linear_motion(inverse_kinematics(begin, now), shifted(begin, (0.0, 0.14, 0.0)))
    along = np.cumsum([0.0, *(float(control_steps(a, b)) for a, b in pairwise(path))])
    times = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / speed)) + 1)
    rows = np.stack([np.interp(times, along, joint) for joint in path.T], axis=1)
    there = {(robot, name): float(q) for name, q in zip(JOINTS, rows[0], strict=True)}
    return state.replace(there | {(robot, "finger"): 0.0}), np.diff(rows, axis=0)


def pushed(friction, seed, speed):
    """States and actions of a push in a world with this friction."""
    domain = get_domain("obstacle_tower", f"{PRESET},friction={friction}")
    state, moves = sweep(domain.task(seed).initial_state, speed)
    world, actions = domain.make_world(state), displacements(domain, moves)
    return [world.state, *(world.step(action) for action in actions)], actions


def as_a_robot_says(states, noise=0.0, seed=0):
    """The states as robot_bridge has them: measured, and with the friction of the preset."""
    rng, layout = np.random.default_rng(seed), states[0].layout
    blocks = [obj for obj in layout.objects if "friction" in obj.type.column]
    measured = []
    for state in states:
        changes = {(block, "friction"): NOMINAL for block in blocks}
        for block in blocks:
            changes |= {
                (block, axis): float(state.get(block, axis)) + noise * float(rng.normal())
                for axis in "xy"
            }
        measured.append(state.replace(changes))
    return measured


def recorded(path, domain, states, actions):
    """A bag of one option that did all of this."""
    task = domain.task(1)
    edge = PlanEdge(hold_option(domain.action_space), Target(0, 0), len(actions))
    execution = PlanExecution(
        0,
        PlanningResult(Plan((edge,)), 1, 1, 1),
        outcomes=[OptionResult(ErrorCode.NONE)],
        steps=[len(actions)],
    )
    episode = EpisodeResult(True, list(states), list(actions), plans=[execution])
    record_run(path, domain, task, episode, 0)
    return path


def calibrate(*arguments):
    return slap("calibrate", *arguments)


@pytest.fixture(scope="module")
def pushes():
    """A fast push and a slower one."""
    return [pushed(TRUE, seed, speed) for seed, speed in ((1, 0.9), (2, 0.6))]


@pytest.fixture(scope="module")
def bag(pushes, tmp_path_factory):
    states, actions = pushes[0]
    path = tmp_path_factory.mktemp("pushes") / "bag"
    return recorded(path, MODEL, as_a_robot_says(states), actions)


def test_friction_that_no_state_says_is_identified_from_a_bag(bag, tmp_path):
    output = tmp_path / "mine.yaml"
    result = calibrate(bag, "--output", output, "--json")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["friction"] == pytest.approx(TRUE, rel=0.1)
    assert found["rms_m"] < 0.1 * found["rms_before_m"]
    assert found["mass_effect_m"] < 0.001
    written = yaml.safe_load(output.read_text())
    for node in ("sim_node", "robot_bridge"):
        assert written[f"/**/{node}"]["ros__parameters"]["preset"] == found["preset"]
    calibrated = get_domain("obstacle_tower", found["preset"]).task(1).initial_state
    block = calibrated.layout.by_name["block1"]
    assert calibrated.get(block, "friction") == pytest.approx(found["friction"], rel=1e-3)


@pytest.mark.slow
def test_friction_is_identified_where_poses_are_a_millimetre_off(pushes):
    found = [
        push
        for seed, (states, actions) in enumerate(pushes)
        for push in find_pushes(as_a_robot_says(states, 0.001, seed), actions)
    ]
    identified = identify_friction(MODEL, found)
    assert identified.friction == pytest.approx(TRUE, rel=0.1)
    assert 0.0005 < identified.rms_m < 0.002


def test_a_push_is_what_slides_and_is_not_held(pushes):
    states, actions = pushes[0]
    found = find_pushes(states, actions)
    assert {obj.name for one in found for obj in one.pushed} == {"block1"}
    assert all(len(one.states) == len(one.actions) + 1 == 4 for one in found)
    block = states[0].layout.by_name["block1"]
    held = [state.replace({(block, "held"): 1.0}) for state in states]
    assert find_pushes(held, actions) == []
    falling = [
        state.replace({(block, "z"): float(state.get(block, "z")) - 0.01 * step})
        for step, state in enumerate(states)
    ]
    assert find_pushes(falling, actions) == []


def test_what_the_arm_did_counts_and_not_what_it_was_told(pushes):
    """A robot that lags behind its commands is not one on another table."""
    states, actions = pushes[0]
    late = [np.zeros_like(actions[0]), *actions[:-1]]
    found = find_pushes(as_a_robot_says(states), late)
    assert identify_friction(MODEL, found).friction == pytest.approx(TRUE, rel=0.1)


def test_a_bag_without_pushes_is_refused_with_what_is_missing(tmp_path):
    state = MODEL.task(1).initial_state
    world, hold = MODEL.make_world(state), [MODEL.action_space.hold] * 5
    states = [world.state, *(world.step(action) for action in hold)]
    output = tmp_path / "mine.yaml"
    result = calibrate(recorded(tmp_path / "bag", MODEL, states, hold), "--output", output)
    assert result.exit_code == InvalidParameterError.code
    message = " ".join(result.stderr.split())
    assert "has no pushes, too few" in message
    assert "record runs in which the hand pushes things" in message
    assert not output.exists()


def test_a_domain_without_friction_is_refused(tmp_path):
    domain = get_domain("obstacle2d")
    world = domain.make_world(domain.task(1).initial_state)
    states = [world.state, world.step(domain.action_space.hold)]
    bag = recorded(tmp_path / "bag", domain, states, [domain.action_space.hold])
    with pytest.raises(InvalidParameterError, match="no mass and friction that could be set"):
        read_pushes(bag)


def test_what_moves_for_another_reason_is_refused(pushes):
    """Someone moves a block by hand: no friction explains it."""
    first = pushes[0][0][0]
    block = first.layout.by_name["block1"]
    drifting = [
        first.replace({(block, "x"): float(first.get(block, "x")) + 0.003 * step})
        for step in range(4)
    ]
    nothing = find_pushes(drifting, [MODEL.action_space.hold] * 3)
    assert len(nothing) == 1
    with pytest.raises(InvalidParameterError, match="an end of the range"):
        identify_friction(MODEL, nothing)


def pushed_by_a_robot(friction, seed):
    """The same on a robot in MuJoCo, which stands still after every step."""
    from slap_ros.robot.mujoco.closed_loop import ClosedLoopWorld

    domain = get_domain("obstacle_tower", f"{PRESET},friction={friction}")
    state, moves = sweep(domain.task(seed).initial_state, 0.9, depth=0.01)
    world, actions = ClosedLoopWorld(domain, state), displacements(domain, moves)
    states = [world.state, *(world.step(action) for action in actions)]
    world.close()
    return as_a_robot_says(states), actions


@pytest.mark.slow
def test_a_robot_that_rests_after_every_step_does_not_tell_friction():
    pytest.importorskip("mujoco")
    found = []
    for seeds in ((1, 2), (3, 4)):
        recordings = [pushed_by_a_robot(0.3, seed) for seed in seeds]
        pushes = [push for states, actions in recordings for push in find_pushes(states, actions)]
        found.append(identify_friction(MODEL, pushes).friction)
    assert abs(found[0] - found[1]) > 0.3  # it is the same friction


def test_a_bag_of_a_robot_is_refused(pushes, tmp_path):
    states, actions = pushes[0]
    measured = open_domain(DomainChoice("obstacle_tower", PRESET, measured=True))
    output = tmp_path / "mine.yaml"
    bag = recorded(tmp_path / "bag", measured, as_a_robot_says(states), actions)
    result = calibrate(bag, "--output", output)
    assert result.exit_code == InvalidParameterError.code
    assert "stands still after every step" in " ".join(result.stderr.split())
    assert not output.exists()
