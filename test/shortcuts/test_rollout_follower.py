# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shortcut that was tried out in the model, in a world that is not quite the model."""

from pathlib import Path

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import SkillNotApplicableError
from slap_ros.evaluation.approaches import approaches
from slap_ros.planning.model import Model
from slap_ros.planning.options import OptionKind
from slap_ros.shortcuts.sampling import Sampling
from slap_ros.shortcuts.shortcut_library import load_library

DATA = Path(__file__).parent / "data" / "obstacle2d"
DOMAIN = get_domain("obstacle2d")
TASK = DOMAIN.task(1)


@pytest.fixture(scope="module")
def shortcut_of_plan():
    """The shortcut of a plan, as an option, and where it starts."""
    space = DOMAIN.atom_space(TASK.initial_state)
    approach = approaches(load_library(DATA, DOMAIN), Sampling(samples=4))[-1]
    planner = approach.planner("lazy", DOMAIN, TASK.initial_state)
    plan = planner.plan(TASK.initial_state, space.mask(TASK.goal)).plan
    model, state = Model.of(DOMAIN, TASK.initial_state), TASK.initial_state
    for edge in plan.edges:
        if edge.option.kind is OptionKind.SHORTCUT:
            return edge.option, state
        state = model.roll_out(edge.option, state, edge.target).final
    raise AssertionError("no shortcut in the plan")


def moved(state, kind, by):
    obj = next(o for o in state.objects if o.type.name == kind)
    return state.replace({(obj, "x"): float(state.get(obj, "x")) + by})


def attempt(option, start):
    ground = option.skill
    return ground.rollouts.successes(ground.shortcut, ground.encoder, start)[option.attempt]


def test_what_is_foreseen_is_what_the_model_does(shortcut_of_plan):
    shortcut, start = shortcut_of_plan
    follow = shortcut.skill.start(start, shortcut.objects)
    world, state = DOMAIN.make_world(start), start
    for _ in attempt(shortcut, start).actions:
        state = world.step(follow(state))
        assert follow.foreseen == state
    follow = shortcut.skill.start(start, shortcut.objects)
    follow(moved(start, "block", 1e-7))  # as predicted, but not to the bit
    assert follow.foreseen is None


def test_the_rollout_is_followed_where_objects_are_a_little_elsewhere(shortcut_of_plan):
    shortcut, start = shortcut_of_plan
    follow = shortcut.skill.start(start, shortcut.objects)
    predicted = attempt(shortcut, start)
    for state, choice in zip(predicted.states, predicted.actions, strict=True):
        action = follow(moved(state, "block", 0.003))
        assert (action == shortcut.skill.command(choice)).all()


def test_a_state_that_cannot_be_is_no_start_and_says_why(shortcut_of_plan):
    """Perceived with noise, blocks side by side are inside one another: the next look may do."""
    shortcut, start = shortcut_of_plan
    free = [o for o in start.objects if o.type.name == "block" and start.get(o, "held") < 0.5]
    beside = float(start.get(free[0], "x")) + 0.001
    inside = start.replace({(free[1], "x"): beside})
    with pytest.raises(SkillNotApplicableError, match=r"tried out: .* inside one another"):
        shortcut.skill.start(inside, shortcut.objects)


def test_the_rollout_is_left_where_the_robot_is_elsewhere(shortcut_of_plan):
    shortcut, start = shortcut_of_plan
    follow = shortcut.skill.start(start, shortcut.objects)
    predicted = attempt(shortcut, start)
    follow(predicted.states[0])
    off = moved(predicted.states[1], "robot", 0.05)
    seen = shortcut.skill.encoder.encode(off.alone()).observations
    bare = shortcut.skill.command(shortcut.skill.shortcut.policy.mean(seen)[0])
    assert np.array_equal(follow(off), bare)
    again = follow(predicted.states[2])  # and not taken up again
    seen = shortcut.skill.encoder.encode(predicted.states[2].alone()).observations
    assert np.array_equal(
        again, shortcut.skill.command(shortcut.skill.shortcut.policy.mean(seen)[0])
    )


def test_a_shortcut_without_gripper_is_over_where_what_is_held_is_lost(shortcut_of_plan):
    shortcut, start = shortcut_of_plan
    held = [o for o in start.objects if "held" in o.type.column and start.get(o, "held") > 0.5]
    dropped = start.replace({(held[0], "held"): 0.0})
    follow = shortcut.skill.start(start, shortcut.objects)
    uses_gripper = any("Holding" in p for _, p, _ in shortcut.skill.shortcut.signature.patterns)
    assert (follow(dropped) is None) is not uses_gripper
    assert shortcut.skill.start(start, shortcut.objects)(start) is not None
