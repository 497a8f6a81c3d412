# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded motions of a hand that acts by forces, played in MuJoCo without looking."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import ControllerAbortedError, InvalidParameterError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.recorded_motion import RecordedMotion
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain

pytest.importorskip("pybullet")
pytest.importorskip("mujoco")

from slap_ros.robot.mujoco.open_loop import OpenLoopPlayer
from slap_ros.robot.mujoco.plant import PERIOD_S, MujocoPlant

SEED = 300
FASTEST = 1.0  # m/s, of anything that is carried or falls from a hand


@pytest.fixture(scope="module")
def stacked():
    """A stack of two cubes, built with the skills that ship."""
    return recorded(open_domain(DomainChoice("stack_at_target")))


def recorded(domain, goal=None):
    task = task_with_goal(domain, SEED, 0, goal)
    episode = solve(domain, task, PURE_PLANNING)
    assert episode.success
    return RecordedMotion.of(domain, SEED, 0, episode.states, task.goal)


def reached(motion, state):
    space = motion.domain.atom_space(motion.states[0])
    return space.abstract(state) & motion.goal == motion.goal


def watched(player):
    """Have a player's plant tell how far anything goes in a period, m, and what is grasped."""
    step, plant, farthest, held = player.plant.step, player.plant, [0.0], []

    def counted():
        before = plant.poses()
        step()
        after = plant.poses()
        ways = (math.dist(before[o].position, after[o].position) for o in before)
        farthest[0] = max(farthest[0], *ways)
        if [plant.grasped()] != held[-1:]:
            held.append(plant.grasped())

    plant.step = counted
    return farthest, held


def test_a_stack_is_built_without_looking_by_contact_alone(stacked):
    player = OpenLoopPlayer(stacked)
    assert player.plant._model.neq == 1  # one coupling, of both fingers: nothing is welded
    farthest, held = watched(player)
    final = player.play()
    assert reached(stacked, final)
    assert farthest[0] < FASTEST * PERIOD_S  # nothing is put anywhere
    assert list(dict.fromkeys(held)) == [None, "cube0", "cube1"]
    assert [(grasp.thing, grasp.closed) for grasp in player.grasps] == [
        ("cube0", True),
        ("cube0", False),
        ("cube1", True),
        ("cube1", False),
    ]
    for name, pose in player.plant.poses().items():
        cube = final.layout.object(name)
        assert tuple(final.get(cube, axis) for axis in "xyz") == pose.position
        planned = [stacked.states[-1].get(cube, axis) for axis in "xyz"]
        assert 1e-5 < math.dist(planned, pose.position) < 0.01  # another physics, and near


def test_what_is_not_where_the_recording_had_it_is_not_stacked(stacked):
    """The motion is the same, so only what stands in MuJoCo can tell."""
    first = stacked.states[0]
    cube = first.layout.object("cube1")
    aside = first.replace({(cube, "y"): float(first.get(cube, "y")) + 0.06})
    player = OpenLoopPlayer(replace(stacked, states=(aside, *stacked.states[1:])))
    with pytest.raises(ControllerAbortedError, match="closed around nothing"):
        player.play()
    assert [grasp.thing for grasp in player.grasps] == ["cube0", "cube0"]


def test_fingers_close_where_those_of_the_recording_have_met_something(stacked):
    """Skills tell them to close while the hand still comes down."""
    closing = [w.step for w in stacked.waypoints if w.gripper is GripperAction.CLOSE]
    for step in closing:
        held = [
            max(s.get(o, "held") for o in s.objects if "held" in o.type.column)
            for s in stacked.states
        ]
        assert (held[step - 2], held[step - 1]) == (0.0, 1.0)
        assert stacked.waypoints[step - 1].gap == pytest.approx(0.04, abs=0.002)  # a cube's edge


@pytest.mark.slow  # a narrow hole: 10 s of the robot's time
@pytest.mark.timeout(180)
def test_a_peg_that_is_grasped_straight_goes_in():
    domain = open_domain(DomainChoice("peg_in_hole", "fair:clearance=5", DEMONSTRATOR))
    motion = recorded(domain, "(In peg1 hole1)")
    assert reached(motion, OpenLoopPlayer(motion).play())


@pytest.mark.parametrize(
    "name", ["stack_at_target", "peg_in_hole", "groceries", "bowls", "stow_hammer", "make_coffee"]
)
def test_what_stands_or_lies_at_a_bench_stays_there(name):
    """Round things, too, which roll where nothing holds them."""
    state = get_domain(name).task(2).initial_state
    plant = MujocoPlant.of(get_domain(name), state)
    placed = {
        o: [float(state.get(state.layout.object(o), a)) for a in "xyz"] for o in plant.motions()
    }
    for _ in range(round(2.0 / PERIOD_S)):
        plant.step()
    for thing, motion in plant.motions().items():
        assert math.dist(placed[thing], motion.pose.position) < 0.002
    assert plant.grasped() is None
    assert all(np.linalg.norm(motion.velocity) < 0.01 for motion in plant.motions().values())


def test_what_cannot_be_played_is_named():
    tower = get_domain("obstacle_tower")
    state = tower.task(1).initial_state
    with pytest.raises(InvalidParameterError, match="obstacle_tower"):
        OpenLoopPlayer(RecordedMotion.of(tower, 1, 0, (state,), frozenset()))
