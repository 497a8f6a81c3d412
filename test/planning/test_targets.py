# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where options end: exactly in an abstract state, or wherever what is expected holds."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.lazy_search import search_lazily
from slap_ros.planning.model import Rollout
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import ground_options
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import Feature, Layout, State, Target, Type

MASKS = st.integers(0, 255)
DOMAIN = get_domain("obstacle2d")
TASK = DOMAIN.task(0)
SPACE = DOMAIN.atom_space(TASK.initial_state)


@given(MASKS, MASKS)
def test_an_exact_target_is_equality(expected, abstract):
    target = Target.exactly(expected)
    assert target.exact and target.reached(abstract) == (abstract == expected)
    assert target.difference(abstract) == abstract ^ expected


@given(MASKS, MASKS, MASKS)
def test_any_other_target_lets_atoms_appear_and_keeps_what_it_asks_for(required, forbidden, more):
    forbidden &= ~required
    target = Target(required, forbidden)
    assert not target.exact
    assert target.reached(required | (more & ~forbidden))
    assert target.reached(required | more) == (not more & forbidden)
    for bit in (1 << i for i in range(8) if required >> i & 1):
        assert not target.reached((required | more) & ~bit)


def test_options_of_a_domain_whose_operators_do_not_say_all_allow_more():
    loose = replace(DOMAIN, exact=False)
    pairs = zip(ground_options(DOMAIN, SPACE), ground_options(loose, SPACE), strict=True)
    for (ground, exact), (_, other) in pairs:
        expected = ground.apply(ground.preconditions)
        assert exact.target(expected) == Target.exactly(expected)
        assert other.target(expected) == Target(expected, ground.delete_effects)


# -- search ---------------------------------------------------------------------------------------

LAYOUT = Layout.of((Type("counter", (Feature("value", "1"),))("c"),))
GOAL = 1 << 10


@dataclass(frozen=True)
class Sloppy:
    """A skill that brings about more than its operator says, or less, as the state decides."""

    name: str
    seed: int
    tightness: float
    step_limit: int = 1000
    least_steps: int = 1

    def outcome(self, state):
        rng = np.random.default_rng([self.seed, int(state.data[0])])
        return 1 + int(rng.integers(0, 20)), int(rng.integers(0, 16)), int(rng.choice([0, 0, 0, 1]))

    def lower_bound(self, state, objects):
        return max(1, int(self.tightness * self.outcome(state)[0]))

    def start(self, state, objects):
        raise AssertionError("never run: the model below knows the outcome")


class WholeModel:
    """Nothing is known of a roll-out before its end."""

    executed = 0

    def raised_bound(self, option, state, target, steps):
        return steps


class SloppyModel(WholeModel):
    """Ends with other atoms than were expected; it is the target that says whether it did."""

    space = SimpleNamespace(decode=lambda mask: (), abstract=lambda state: 0)

    def roll_out(self, option, state, target):
        steps, more, lost = option.skill.outcome(state)
        abstract = (target.required | more) & ~lost
        return Rollout(target.reached(abstract), steps, State(LAYOUT, [float(more)]), abstract)


@st.composite
def graphs(draw):
    """Nodes are masks of ten atoms; of the options, some are exact and others are not."""
    size = draw(st.integers(2, 8))
    nodes = draw(st.lists(st.integers(0, GOAL - 1), min_size=size, max_size=size, unique=True))
    graph = AbstractGraph(GOAL, nodes, [0] * size)
    goals = draw(st.sets(st.integers(1, size - 1), min_size=1))
    for goal in goals:
        graph.nodes[goal] |= GOAL
    pairs = [(i, j) for i in range(size) for j in range(size) if i != j and i not in goals]
    for number, (i, j) in enumerate(draw(st.lists(st.sampled_from(pairs), max_size=25))):
        skill = Sloppy(f"s{number}", draw(st.integers(0, 10**6)), draw(st.sampled_from([0.0, 1.0])))
        deletes = draw(st.one_of(st.none(), st.integers(0, GOAL - 1)))
        graph.edges.append(Edge(i, j, Option(OptionKind.OPERATOR, skill, (), deletes=deletes)))
    return graph


@settings(max_examples=400, deadline=None)
@given(graphs())
def test_lazy_and_exhaustive_agree_where_atoms_may_appear(graph):
    start, costs = State(LAYOUT, [0.0]), []
    for search in (search_lazily, search_exhaustively):
        plan = search(graph, start, SloppyModel()).plan
        if plan is None:
            costs.append(None)
            continue
        costs.append(plan.predicted_steps)
        state, held = start, graph.nodes[0]
        for edge in plan.edges:
            rollout = SloppyModel().roll_out(edge.option, state, edge.target)
            assert edge.target.reached(rollout.abstract)
            assert edge.target.exact == (edge.option.deletes is None)
            state, held = rollout.final, rollout.abstract
        assert held & GOAL
    assert costs[0] == costs[1]


def test_plans_of_given_skills_are_the_same_where_more_is_allowed():
    """Given skills change what operators say and nothing else, so that it makes no difference."""
    for index in range(30):
        task = DOMAIN.task(7, index)
        goal = DOMAIN.atom_space(task.initial_state).mask(task.goal)
        plans = []
        for domain in (DOMAIN, replace(DOMAIN, exact=False)):
            planner = make_planner("lazy", domain, task.initial_state)
            plan = planner.plan(task.initial_state, goal).plan
            plans.append([(str(e), e.target.required, e.predicted_steps) for e in plan.edges])
        assert plans[0] == plans[1]


# -- failures -------------------------------------------------------------------------------------


def atom(predicate, *names):
    return SPACE.mask([SPACE.atom(predicate, names)])


@pytest.mark.parametrize(
    ("appear", "vanish", "exact", "other"),
    [
        ("", "", "", ""),
        (
            "",
            "Holding robot block1",
            "Holding(robot, block1) missing: effect not reached",
            "Holding(robot, block1) missing: effect not reached",
        ),
        (
            "GripperEmpty robot",
            "",
            "GripperEmpty(robot) too many: effect not reached",
            "GripperEmpty(robot) too many: effect not reached",
        ),
        (
            "",
            "On block3 table",
            "On(block3, table) missing: something else disturbed",
            "On(block3, table) missing: something else disturbed",
        ),
        ("Clear target", "", "Clear(target) too many: something else disturbed", ""),
    ],
)
def test_failures_tell_apart_what_was_not_reached_and_what_was_disturbed(
    appear, vanish, exact, other
):
    """Of Pick(robot, block1, table); empty where it counts as done."""
    for domain, words in ((DOMAIN, exact), (replace(DOMAIN, exact=False), other)):
        start = SPACE.abstract(TASK.initial_state)
        named = {str(ground): (ground, option) for ground, option in ground_options(domain, SPACE)}
        ground, option = named["Pick(robot, block1, table)"]
        end = ground.apply(start)
        end |= atom(*appear.split()) if appear else 0
        end &= ~(atom(*vanish.split()) if vanish else 0)
        execution = OptionExecution(
            option,
            option.target(ground.apply(start)),
            SPACE,
            DOMAIN.action_space,
            TASK.initial_state,
        )
        execution.advance(TASK.initial_state, start)
        execution.steps = option.skill.step_limit
        ended = execution.advance(TASK.initial_state, end)
        assert isinstance(ended, OptionResult)
        assert ended.code is (ErrorCode.SKILL_STEP_LIMIT if words else ErrorCode.NONE)
        assert ended.reason.endswith(f"steps with {words}" if words else "")


@dataclass(frozen=True)
class Endless(Sloppy):
    """A policy that goes on and on."""

    def start(self, state, objects):
        return lambda _: np.zeros(len(DOMAIN.action_space.low))


@pytest.mark.parametrize(
    ("kind", "expected", "steps"),
    [
        (OptionKind.SHORTCUT, 8, 16),
        (OptionKind.SHORTCUT, 2, 10),  # few steps say little
        (OptionKind.SHORTCUT, 0, 40),  # nothing is known
        (OptionKind.SHORTCUT, 30, 40),
        (OptionKind.OPERATOR, 8, 40),
    ],
)
def test_a_shortcut_that_takes_far_longer_than_in_the_model_is_given_up(kind, expected, steps):
    """It has led elsewhere, where its policy was never trained: planning again is better."""
    option = Option(kind, Endless("Endless", 0, 0.5, step_limit=40), ())
    state, start = TASK.initial_state, SPACE.abstract(TASK.initial_state)
    execution = OptionExecution(
        option, Target.exactly(0), SPACE, DOMAIN.action_space, state, expected_steps=expected
    )
    for _ in range(steps):
        assert not isinstance(execution.advance(state, start), OptionResult)
    assert execution.advance(state, start).code is ErrorCode.SKILL_STEP_LIMIT


# -- where everything fails -----------------------------------------------------------------------

AT_START, ON_WAY, BROKEN = 1, 2, 8  # abstract states; the goal is out of reach from BROKEN


@dataclass(frozen=True)
class Failing(Sloppy):
    """Ends in an abstract state of its own, after as many steps."""

    ends: int = 0


class FailingModel(WholeModel):
    """What options end in is what they say."""

    space = SimpleNamespace(decode=lambda mask: (), abstract=lambda state: int(state.data[0]))

    def roll_out(self, option, state, target):
        ends, steps = option.skill.ends, option.skill.seed
        return Rollout(target.reached(ends), steps, State(LAYOUT, [float(ends)]), ends)


def made_up(skill, kind=OptionKind.OPERATOR):
    return Option(kind, skill, (), deletes=0)


@pytest.mark.parametrize("search", [search_lazily, search_exhaustively])
def test_where_everything_fails_the_search_tells_how_far_it_came(search):
    graph = AbstractGraph(GOAL, [AT_START, ON_WAY, GOAL], [0, 1, 2])
    graph.edges += [
        Edge(0, 1, made_up(Failing("walks", 4, 0.0, ends=ON_WAY))),
        Edge(1, 2, made_up(Failing("stumbles", 3, 0.0, ends=ON_WAY))),
        Edge(0, 2, made_up(Failing("breaks", 5, 0.0, ends=BROKEN))),
        Edge(0, 2, made_up(Failing("stays", 0, 0.0, ends=AT_START))),
        Edge(0, 2, made_up(Failing("slaps", 5, 0.0, ends=BROKEN), OptionKind.SHORTCUT)),
    ]
    start = State(LAYOUT, [float(AT_START)])
    outcome = search(graph, start, FailingModel())
    assert outcome.plan is None
    assert outcome.reason
    found = {str(path.plan.edges[-1]): path for path in outcome.failed}
    assert set(found) == {"stumbles()", "breaks()"}
    assert [str(edge) for edge in found["stumbles()"].plan.edges] == ["walks()", "stumbles()"]
    assert [path.abstract for path in found.values()] == [
        {"stumbles()": ON_WAY, "breaks()": BROKEN}[name] for name in found
    ]
    assert found["stumbles()"].plan.predicted_steps == 7
    assert found["stumbles()"].node == 2
