# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: tasks, the paper's plans, operators that say exactly what happens."""

import math

import numpy as np
import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.benchtop.approach import ASIDE, DISTANCE
from slap_ros.domains.benchtop.state_access import hand_position, position_of, standing_on
from slap_ros.domains.stack_at_target.model import CUBE, IS_CLEAR, ON, TARGET
from slap_ros.errors import InvalidParameterError, UnknownObjectError
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.studies.lg_sail.vacuity import gather_starts, try_policies
from support.states import fluent_atoms, initial_states_at_rest

NAME = "stack_at_target"
DOMAIN = get_domain(NAME)
INITIAL = {
    "HandEmpty()",
    *(f"{atom}({cube})" for atom in ("OnTable", "IsClear") for cube in ("cube0", "cube1")),
    "IsClear(target0)",
}
PRINTED = ["Pick(cube0)", "Place(cube0, target0)", "Pick(cube1)", "Place(cube1, cube0)"]
REAL = ["Pick(cube1)", "Place(cube1, target0)", "Pick(cube0)", "Place(cube0, cube1)"]
CLEARED = ["Unstack(target0, cube2)", "Place(cube2, target1)"]


def with_demonstrator(preset):
    return open_domain(DomainChoice(NAME, preset, DEMONSTRATOR))


def test_tasks_differ_and_rest():
    states = initial_states_at_rest(DOMAIN, lambda layout: layout.of_type(CUBE))
    assert all(fluent_atoms(state, DOMAIN) == INITIAL for state in states)


@pytest.mark.parametrize(
    ("preset", "goal", "plan"),
    [
        ("fair", "training", PRINTED),
        ("paper", "real", REAL),
        ("fair:cubes=4", "training", PRINTED),
        ("fair:blocked=1", "real", [*CLEARED, *REAL]),
        ("fair:cubes=4,blocked=1", "training", 6),
        ("fair:cubes=4,blocked=2", "training", 6),
    ],
)
def test_the_demonstrator_does_exactly_what_operators_say(preset, goal, plan):
    """As many as the paper's plan has, each to exactly the atoms that it predicts."""
    domain = with_demonstrator(preset)
    for seed in range(2):
        task = domain.task(seed, goal=goal)
        episode = demonstrate(domain, task).episode
        done = [f"{edge.option}({', '.join(edge.objects)})" for edge in episode.edges]
        assert done == plan or len(done) == plan
        assert episode.success
        assert all(edge.reached for edge in episode.edges)
        assert {str(atom) for atom in task.goal} <= fluent_atoms(episode.states[-1], domain)
        with domain.make_world(episode.states[-1]) as world:  # it stands when the hand has left
            for _ in range(10):
                world.step(np.array([0.0, 0.0, 0.02, 0.0, -1.0]))
            assert all(atom.holds(world.state) for atom in task.goal)


@pytest.mark.parametrize(
    ("aside", "up", "held", "speed", "on", "clear"),
    [
        (0.0, 0.0, 0.0, 0.0, True, False),
        (0.0099, 0.0, 0.0, 0.0, True, False),
        (0.0101, 0.0, 0.0, 0.0, False, False),
        (0.0, 0.0049, 0.0, 0.0, True, False),
        (0.0, 0.0051, 0.0, 0.0, False, False),
        (0.0, -0.0051, 0.0, 0.0, False, True),
        (0.0, 0.0, 1.0, 0.0, False, False),
        (0.0, 0.0, 0.0, 0.06, False, False),
        (0.0, 0.0201, 1.0, 0.0, False, True),
        (0.0301, 0.0, 0.0, 0.0, False, True),
    ],
)
@pytest.mark.parametrize("place", ["target0", "cube0"])
def test_what_is_on_a_place(place, aside, up, held, speed, on, clear):
    state = DOMAIN.task(0).initial_state
    cube, under = state.layout.object("cube1"), state.layout.object(place)
    x, y, z = standing_on(state, cube, under)
    placed = {"x": x + aside, "y": y, "z": z + up, "held": held, "vy": speed}
    state = state.replace({(cube, feature): value for feature, value in placed.items()})
    assert ON(cube, under).holds(state) == on
    assert IS_CLEAR(under).holds(state) == clear


def test_the_approach_is_a_function_of_the_state_and_ends_aside():
    for start in starts():
        layout = DOMAIN.task(0).initial_state.layout
        state = State(layout, np.array(start["state"]))
        *_, last = (layout.object(name) for name in start["objects"])
        if start["operator"] == "Pick":
            hand, there = hand_position(state), position_of(state, last)
        else:
            cube = layout.object(start["objects"][0])
            hand, there = position_of(state, cube), standing_on(state, cube, last)
        assert hand[2] - there[2] == pytest.approx(DISTANCE, abs=0.004)
        aside = math.dist(hand[:2], there[:2])
        assert ASIDE[0] - 0.004 <= aside <= ASIDE[1] + 0.004
    assert starts() == starts()


def starts():
    return gather_starts(DomainChoice(NAME, "", DEMONSTRATOR), "training", 0, 0)


def test_nothing_less_than_a_skill_picks_or_places():
    """The study has figures of many more starts."""
    choice = DomainChoice(NAME, "", DEMONSTRATOR)
    found = starts()
    assert [start["operator"] for start in found] == ["Pick", "Place"] * 2
    for start in found:
        outcomes = try_policies(choice, 0, start)
        assert set(outcomes.values()) == {None}, (start["operator"], outcomes)


def test_the_goal_needs_its_objects():
    with pytest.raises(UnknownObjectError, match="cube1"):
        DOMAIN.goals["real"](State.build({TARGET("target0"): target()}))


def target():
    return dict.fromkeys((feature.name for feature in TARGET.features), 0.0)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("cubes=1", "'cubes' is 1; it must be from 2 to 4"),
        ("blocked=3", "'blocked' is 3; it must be from 0 to 2"),
        ("blocked=some", "'some' cannot replace"),
        ("apart=nan", "'apart' is nan"),
        ("x=0.1..0.9", "'x' is"),
        ("cubes=4,apart=0.3", "no room for 5 things 0.3 m apart"),
    ],
)
def test_settings_that_cannot_be(setting, message):
    with pytest.raises(InvalidParameterError, match=message):
        get_domain(NAME, f"fair:{setting}").task(0)
