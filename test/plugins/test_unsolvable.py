# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""UNSOLVABLE says what was tried and what came out differently, wherever it is told."""

from dataclasses import dataclass, replace

import pytest

from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.bags import evaluate_bag, read_bag
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, SkillNotApplicableError, UnsolvableError
from slap_ros.messages.interfaces import PLAN_EVENT
from slap_ros.planning.planner import make_planner
from slap_ros.skills.domain_choice import DomainChoice
from support import patchy, sweeping
from support.slap_command import slap

OUT_OF_REACH = patchy.make("none")
# What the skill does is not what its operator promises.
MISSING = "with Swept(puck0) missing and Left(puck0) too many"
CAME_OUT = f"Sweep(broom, puck0) ended after 60 steps {MISSING}"


def why(domain, planner="lazy", goal=None):
    task = domain.task(0)
    space = domain.atom_space(task.initial_state)
    with pytest.raises(UnsolvableError) as caught:
        make_planner(planner, domain, task.initial_state).plan(
            task.initial_state, space.mask(goal or task.goal)
        )
    return str(caught.value)


@pytest.mark.parametrize("planner", ["lazy", "exhaustive", "ff"])
def test_the_atoms_that_came_out_differently_are_named(planner):
    said = why(OUT_OF_REACH, planner)
    assert CAME_OUT in said
    assert "options failed in the model" in said
    assert len(said) < 400


@dataclass(frozen=True)
class Outspoken(sweeping.Sweep):
    """Says why it cannot start."""

    def start(self, state, objects):
        _, puck = objects
        if state[puck][1] < 0:
            raise SkillNotApplicableError(f"{puck.name} lies 1.0 m beyond the broom's reach")
        return super().start(state, objects)


@pytest.mark.parametrize("planner", ["lazy", "exhaustive", "ff"])
def test_a_skills_own_words_are_told(planner):
    domain = replace(OUT_OF_REACH, skills={"Sweep": Outspoken()})
    assert "Sweep(broom, puck0): puck0 lies 1.0 m beyond the broom's reach" in why(domain, planner)


@dataclass(frozen=True)
class Endless(sweeping.Sweep):
    """Never says that it has ended."""

    def start(self, state, objects):
        policy, hold = super().start(state, objects), sweeping.ACTIONS.hold
        return lambda now: hold if (action := policy(now)) is None else action


@dataclass(frozen=True)
class Reckless(sweeping.Sweep):
    """Wants to move too far."""

    def start(self, state, objects):
        return lambda now: sweeping.ACTIONS.hold + 1.0


@pytest.mark.parametrize(
    ("skill", "words"),
    [
        (Endless(), "ended after 60 steps with Swept(puck0) missing and Left(puck0) too many"),
        (Reckless(), ": command x = 1.0 m is not within [-0.1, 0.1]"),
    ],
)
def test_every_other_way_to_fail_has_its_words(skill, words):
    assert words in why(replace(OUT_OF_REACH, skills={"Sweep": skill}))


@pytest.mark.parametrize("planner", ["lazy", "ff"])
def test_a_goal_that_no_operator_has_is_told_by_its_atoms(planner):
    task = OUT_OF_REACH.task(0)
    puck = task.initial_state.layout.object("puck0")
    never = sweeping.Predicate("Blue", (sweeping.PUCK,), lambda s, c: sweeping._past(s, c) > 9.0)
    domain = replace(OUT_OF_REACH, predicates=(*OUT_OF_REACH.predicates, never))
    assert "no operator leads to Blue(puck0)" in why(domain, planner, {never(puck)})
    both = {sweeping.SWEPT(puck), sweeping.LEFT(puck)}
    assert "Left(puck0), Swept(puck0) never hold together" in why(domain, planner, both)


def test_a_message_stays_short_however_much_failed():
    @dataclass(frozen=True)
    class Verbose(sweeping.Sweep):
        def start(self, state, objects):
            raise SkillNotApplicableError("no")

    domain = replace(OUT_OF_REACH, skills={"Sweep": Verbose()})
    assert "2 of 2 options failed in the model" in why(domain)
    assert "; and 1 more" in why(domain)


def test_command_line_bag_and_result_say_the_same(install, network, tmp_path):
    install({"patchy": "support.patchy:make"})
    planned = slap("plan", "patchy", "--preset", "none")
    assert planned.exit_code == ErrorCode.UNSOLVABLE
    assert CAME_OUT in planned.stderr
    bag = tmp_path / "bag"
    settings = RunSettings(
        DomainChoice("patchy", "none"), 0, 0, "lazy", str(bag), shortcuts="none", patience=5.0
    )
    metrics = run(RunRequest(settings, timeout_s=200, in_process=True), lambda *_: None)
    assert metrics.error_code == ErrorCode.UNSOLVABLE
    assert CAME_OUT in metrics.error_msg
    (recorded,) = evaluate_bag(bag).runs
    assert recorded.error_msg == metrics.error_msg
    events = [m.message for m in read_bag(bag) if m.type_name == PLAN_EVENT]
    assert any(CAME_OUT in event.error_msg for event in events)
    assert get_domain("patchy").preset == "some"
