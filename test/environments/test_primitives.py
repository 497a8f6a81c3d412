# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movements with parameters: enough to solve a task, aimed at what its plan is about."""

import math
import re

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.hand_motion import nearest_turn
from slap_ros.domains.benchtop.primitives import PRIMITIVES
from slap_ros.domains.benchtop.state_access import position_of, standing_on, yaw_of
from slap_ros.environments.controls import PrimitiveControl
from slap_ros.environments.registration import make_task_env
from slap_ros.errors import InvalidCommandError, InvalidParameterError, NoSkillsError

LOW, HIGH = PRIMITIVES.low, PRIMITIVES.high
NAMES = ["joints", "reach", "grasp", "place", "push", "open"]
MADE = {"control": "primitives", "reward": "stages", "goal": "training"}


@pytest.fixture(scope="module")
def env():
    made = make_task_env("stack_at_target", "fair", **MADE)
    yield made
    made.close()


def action(name, offset=(0.0, 0.0, 0.0), yaw=0.0, push=(0.0, 0.0, 0.0), joints=(0.0,) * 5):
    """The action that does one thing, so far from what the present stage is about."""
    scores = np.full(len(NAMES), -1.0)
    scores[NAMES.index(name)] = 1.0
    told = 2.0 * (np.array([*offset, yaw, *push]) - LOW) / (HIGH - LOW) - 1.0
    own = [
        told[: PRIMITIVES.sizes[one]] if one == name else np.ones(PRIMITIVES.sizes[one])
        for one in NAMES[1:]
    ]  # what others take does not matter
    return np.array([*scores, *joints, *np.concatenate(own)], dtype=np.float32)


def stacked(env):
    """Each cube of the goal and what it is to stand on, from below."""
    names = dict(reversed(re.findall(r"\w+", goal)[1:]) for goal in env._info()["goal"])
    objects, under = env._episode.state.layout.by_name, "target0"
    while under in names:
        yield objects[names[under]], objects[under]
        under = names[under]


def begin(env, index=0):
    """Begin a task; what is picked first, and what it is put on."""
    env.reset(seed=300, options={"index": index})
    return next(stacked(env))


def test_whoever_knows_how_to_grasp_and_to_place_solves_a_task(env):
    for index in range(3):
        begin(env, index)
        for cube, under in list(stacked(env)):
            state = env._episode.state
            yaw = nearest_turn(yaw_of(state, cube), 0.5 * math.pi)
            env.step(action("grasp", yaw=yaw))
            state = env._episode.state
            above = np.subtract(standing_on(state, cube, under), position_of(state, under))
            *_, info = env.step(action("place", tuple(above)))
        assert info["success"]
        assert info["progress"] == 1.0


def test_a_push_moves_what_is_in_its_way_and_the_hand_goes_where_it_reaches(env):
    cube, _ = begin(env)
    x, *_ = position_of(env._episode.state, cube)
    env.step(action("push", (-0.1, 0.0, 0.0), push=(0.1, 0.0, 0.0)))
    pushed = position_of(env._episode.state, cube)
    assert pushed[0] > x + 0.02
    env.step(action("reach", (0.0, 0.05, 0.1)))
    state = env._episode.state
    hand = position_of(state, state.layout.by_name["robot"])
    assert hand == pytest.approx(np.add(pushed, (0.0, 0.05, 0.1)), abs=0.005)


def test_what_the_next_stage_is_about_is_aimed_at_once_one_is_done(env):
    cube, under = begin(env)
    yaw = nearest_turn(yaw_of(env._episode.state, cube), 0.5 * math.pi)
    *_, info = env.step(action("grasp", yaw=yaw))
    assert info["progress"] == 0.25
    env.step(action("reach", (0.0, 0.0, 0.1)))
    state = env._episode.state
    hand = position_of(state, state.layout.by_name["robot"])
    assert hand == pytest.approx(np.add(position_of(state, under), (0.0, 0.0, 0.1)), abs=0.005)


def test_joints_move_for_one_step_and_fingers_open_where_they_are(env):
    begin(env)
    *_, info = env.step(action("joints", joints=(0.0, 0.0, 1.0, 0.0, 0.0)))
    assert info["steps"] == 1
    *_, info = env.step(action("open"))
    assert 1 <= info["steps"] - 1 <= 10


def test_what_is_near_the_target_is_afforded_and_what_has_no_point_is_too():
    control = PrimitiveControl(get_domain("stack_at_target", "fair"))
    near, far, farther = (control.affordance(action("grasp", (x, 0, 0))) for x in (0.01, 0.05, 0.1))
    assert near == pytest.approx(1.0)
    assert 1.0 > far > farther > 0.0
    for name in ("joints", "open"):
        assert control.affordance(action(name, (0.1, 0.1, 0.1))) == 1.0


def test_what_is_no_primitive_is_refused(env):
    begin(env)
    with pytest.raises(InvalidCommandError, match="30 finite numbers"):
        env.step(np.zeros(5))
    with pytest.raises(InvalidParameterError, match="no skills, so there is no mask"):
        env.action_masks()
    with pytest.raises(InvalidParameterError, match="there are stages"):
        make_task_env("stack_at_target", control="primitives")
    with pytest.raises(NoSkillsError, match="obstacle2d has no primitives"):
        make_task_env("obstacle2d", control="primitives", reward="stages")
