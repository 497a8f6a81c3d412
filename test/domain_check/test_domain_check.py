# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`slap check` passes sound domains, and names what is wrong with others."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from slap_ros.core import Task
from slap_ros.domain_check import check_domain
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import Obstacle2DWorld
from slap_ros.domains.registry import OURS
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import Predicate, State
from support.marks import slow
from support.slap_command import slap

FLAT = get_domain("obstacle2d")
QUICK = ("obstacle2d", "obstacle_tower", "peg_in_hole")
PHYSICS = set(OURS) - {"obstacle2d"}


def findings(domain, tasks=3, states=40):
    return {check.name: check for check in check_domain(domain, 0, tasks, states)}


@pytest.mark.parametrize("name", [*QUICK, *slow(*sorted(set(OURS) - set(QUICK)))])
def test_every_domain_keeps_to_the_contract(name):
    if name in PHYSICS:
        pytest.importorskip("pybullet")
    domain = get_domain(name)
    found = findings(domain, tasks=1 if name in PHYSICS else 10)
    assert not {check.name: check.found for check in found.values() if check.status == "problem"}
    solved = found["pure planning" if domain.operators else "demonstrator"].found
    assert re.fullmatch(r"all \d+ tasks?, in \d+ to \d+ steps", solved)
    assert found["Markov"].found.startswith("40 steps")


class Drifting(Obstacle2DWorld):
    """Goes on from where a hidden counter says, which no reset sets."""

    steps = 0

    def step(self, action):
        self.steps += 1
        state = super().step(action)
        robot = state.layout.object("robot")
        return state.replace({(robot, "x"): float(state.get(robot, "x")) + 1e-12 * self.steps})


def test_a_world_that_remembers_what_the_state_does_not_say_is_not_markov():
    found = findings(replace(FLAT, make_world=Drifting))["Markov"]
    assert found.status == "problem"
    assert "robot.x" in found.found
    assert "RebuildEachStep" in found.advice


class Rounding(Obstacle2DWorld):
    """Takes states over in single precision."""

    def reset(self, state):
        super().reset(State(state.layout, state.data.astype(np.float32)))


def test_a_reset_that_rounds_is_found():
    assert findings(replace(FLAT, make_world=Rounding))["reset"].status == "problem"


def with_predicate(name, **changes):
    old = next(p for p in FLAT.predicates if p.name == name)
    predicates = tuple(replace(p, **changes) if p is old else p for p in FLAT.predicates)
    return replace(FLAT, predicates=predicates)


@pytest.mark.parametrize(
    ("broken", "shape"),
    [
        (lambda held: held[..., :1], r"\(1,\) for 2 atoms and states of shape \(\d+,\)"),
        (lambda held: held.reshape(-1)[:2], r"\(2,\) for 2 atoms and states of shape \(2, \d+\)"),
    ],
)
def test_a_predicate_of_another_shape_is_found_though_it_would_fit(broken, shape):
    holding = next(p for p in FLAT.predicates if p.name == "Holding")
    domain = with_predicate(
        "Holding", classifier=lambda *given: broken(holding.classifier(*given)), margin=None
    )
    found = findings(domain, tasks=1)["predicates"]
    assert found.status == "problem"
    assert re.search(f"classifier of Holding has the shape {shape}", found.found)


def test_a_margin_that_contradicts_its_predicate_is_found():
    on = next(p for p in FLAT.predicates if p.name == "On")
    found = findings(with_predicate("On", margin=lambda *a: -on.margin(*a) - 1e-4))["margins"]
    assert found.status == "problem"
    assert re.match(r"On\(\w+, \w+\) (holds, .* -|does not hold, .* )\d", found.found)


def test_a_predicate_that_reads_the_robot_though_its_type_is_said_to_be_unread_is_found():
    empty = next(p for p in FLAT.predicates if p.name == "GripperEmpty")

    def low(state, robot):
        return empty.classifier(state, robot) & (state.stack(robot, "x") < 0.5)

    domain = with_predicate("GripperEmpty", classifier=low)
    found = findings(domain, tasks=1)["unread features"]
    assert found.status == "problem"
    assert found.found == "GripperEmpty(robot) changes with the robot's features alone"
    changed = next(p for p in domain.predicates if p.name == "GripperEmpty")
    for sound in (
        replace(domain, robot_predicates=frozenset({changed})),
        replace(domain, robot_types=frozenset()),
    ):
        assert findings(sound, tasks=1)["unread features"].status == "ok"


def test_a_predicate_that_changes_though_no_operator_says_so_is_found():
    on = next(p for p in FLAT.predicates if p.name == "On")
    lifted = Predicate("Lifted", on.types[:1], lambda s, block: s.stack(block, "held") > 0.5)
    domain = replace(FLAT, predicates=(*FLAT.predicates, lifted))
    found = findings(domain)["unread features"]
    assert found.status == "problem"
    assert found.found.startswith("Lifted counts as static, as no operator changes it, but Lifted(")


ASKED = FLAT.learning.interface


@pytest.mark.parametrize(
    ("answers", "found"),
    [
        ({"hand": lambda s: s.data}, "raises "),
        (
            {"robot": lambda s, h: h[0]},
            r"robot has the shape \(\d\,\) for 8 states, wanted \(8, k\)",
        ),
        ({"objects": lambda s, h, c: np.ones((8, 2))}, r"objects of \w+ has the shape \(8, 2\)"),
        (
            {"objects": lambda *given: np.nan * ASKED.objects(*given)},
            "objects of blocks is not finite everywhere",
        ),
        (
            {"distance": lambda *given: ASKED.distance(*given)[:, 0]},
            r"distance of blocks has the shape \(8,\) for 8 states, wanted \(8, \d\)",
        ),
        ({"separation": lambda *given: ASKED.separation(*given)[0]}, "separation of blocks has"),
        ({"at_rest": lambda s: True}, r"at_rest has the shape \(\)"),
        ({"grasping": frozenset({"Holding"})}, "grasping has Holding, which the domain does not"),
    ],
)
def test_a_learners_interface_that_no_learner_could_use_is_found(answers, found):
    changed = replace(ASKED, **answers)
    domain = replace(FLAT, learning=replace(FLAT.learning, interface=changed))
    check = findings(domain, tasks=1)["learner's interface"]
    assert check.status == "problem"
    assert re.match(found, check.found)


def test_names_that_no_node_could_write_are_found():
    found = findings(replace(FLAT, name="obstacle 2d"), tasks=1)["names"]
    assert found.status == "problem"
    assert "'obstacle 2d' cannot name a domain" in found.found


def test_initial_states_on_a_threshold_are_found():
    clear: Predicate = next(p for p in FLAT.predicates if p.name == "Clear")
    touchy = with_predicate("Clear", margin=lambda *a: np.where(clear.margin(*a) >= 0, 0.0, -1.0))
    found = findings(touchy)["thresholds"]
    assert (found.status, "Clear(" in found.found) == ("warning", True)


class TooHigh:
    """A skill that claims to need more steps than it does."""

    least_steps = 1

    def __init__(self, skill):
        self.skill = skill
        self.name, self.step_limit = skill.name, skill.step_limit

    def lower_bound(self, state, objects):
        return self.skill.lower_bound(state, objects) + 5

    def start(self, state, objects):
        return self.skill.start(state, objects)


def test_a_bound_that_hides_plans_is_found():
    skills = {name: TooHigh(skill) for name, skill in FLAT.skills.items()}
    found = findings(replace(FLAT, skills=skills))["lower bounds"]
    assert found.status == "problem"
    assert re.search(r"took (\d+) steps; its skill says at least (\d+)", found.found)


class Moody(TooHigh):
    """A skill that is a little slower every time."""

    starts = 0

    def lower_bound(self, state, objects):
        return 1

    def start(self, state, objects):
        policy = self.skill.start(state, objects)
        Moody.starts += 1
        slow = 1.0 - 1e-9 * Moody.starts
        return lambda state: None if (action := policy(state)) is None else action * [slow, slow, 1]


def test_a_skill_with_a_memory_is_found():
    skills = {name: Moody(skill) for name, skill in FLAT.skills.items()}
    assert findings(replace(FLAT, skills=skills))["skills"].status == "problem"


def test_tasks_that_are_over_before_they_begin_are_found():
    def sample(rng):
        task = FLAT.sample_task(rng)
        space = FLAT.atom_space(task.initial_state)
        holding = space.decode(space.abstract(task.initial_state))
        return Task(task.initial_state, frozenset(list(holding)[:1]), task.step_limit)

    found = findings(replace(FLAT, sample_task=sample))["tasks"]
    assert (found.status, "goal of task 0" in found.found) == ("problem", True)


def test_tasks_that_come_from_elsewhere_than_the_seed_are_found():
    outside = np.random.default_rng(0)
    found = findings(replace(FLAT, sample_task=lambda _: FLAT.sample_task(outside)))["tasks"]
    assert (found.status, "sampled again" in found.found) == ("problem", True)


def test_a_domain_in_which_nothing_can_be_solved_says_why_and_is_checked_all_the_same():
    class Lame(TooHigh):
        def start(self, state, objects):
            return lambda _: None

    found = findings(replace(FLAT, skills={n: Lame(s) for n, s in FLAT.skills.items()}))
    assert found["pure planning"].status == "problem"
    assert found["pure planning"].found.startswith("0 of 3 tasks solved; not so: ")
    assert found["Markov"].status == "ok"


class Odd(TooHigh):
    """A skill whose answers are replaced."""

    def __init__(self, skill, answers):
        super().__init__(skill)
        self.answers = answers

    def lower_bound(self, state, objects):
        return self.answers.get("lower_bound", 1)

    def start(self, state, objects):
        return self.answers.get("start", lambda _: self.answers.get("action"))


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"lower_bound": None}, r"skill \w+: lower_bound gives NoneType, expected a number"),
        ({"start": None}, r"skill \w+: start gives NoneType, expected a policy"),
        ({"start": iter(())}, r"skill \w+: start gives tuple_iterator, expected a policy"),
        ({"action": [0.0, 0.0, 1.0]}, r"a command has 3 entries .*, got list, not an array"),
    ],
)
def test_what_skills_answer_is_named_where_it_will_not_do(answers, words):
    skills = {name: Odd(skill, answers) for name, skill in FLAT.skills.items()}
    found = findings(replace(FLAT, skills=skills))["pure planning"]
    assert found.status == "problem"
    assert re.search(words, found.found)


def test_a_goal_that_is_a_list_is_named():
    def sample(rng):
        task = FLAT.sample_task(rng)
        return replace(task, goal=list(task.goal))

    with pytest.raises(InvalidDomainError, match="the goal of sample_task is a list, expected a f"):
        replace(FLAT, sample_task=sample).task(0)
    named = replace(FLAT, goals={"mine": lambda state: list(FLAT.default_goal(state))})
    with pytest.raises(InvalidDomainError, match="the goal 'mine' is a list"):
        named.task(0, goal="mine")


def test_the_command_prints_what_it_found_and_answers_with_a_code():
    result = slap("check", "obstacle2d", "--tasks", "2", "--json")
    assert result.exit_code == 0
    assert {"name", "status", "found", "advice"} == set(json.loads(result.stdout)[0])
