# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a skill fails from every way to it, the plan may come back to where it was.

There is a ball in a drawer. Each time the drawer is opened, the ball rolls on towards the front. It
is taken there; further behind, the hand knocks it out of the drawer. A vase on the drawer may fall
when it is opened, which no operator says; who has the ball can raise it.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from slap_ros.core import ActionSpace, Domain, Execution, Task
from slap_ros.errors import ErrorCode, PlanningLimitError, UnsolvableError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.evaluation.experiment import solve
from slap_ros.planning.abstract_graph import build_unrolled_graph
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import Problem
from slap_ros.planning.recovery import Recovery
from slap_ros.relational import (
    Feature,
    Layout,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Type,
    Variable,
)

FEATURES = ("open", "inside", "held", "opened", "front", "vase", "shaky")
DRAWER = Type("drawer", tuple(Feature(name, "1") for name in FEATURES))
D = Variable("?drawer", DRAWER)
THE_DRAWER = DRAWER("drawer")
LAYOUT = Layout.of((THE_DRAWER,))
ACTIONS = ActionSpace((Feature("pull", "1"), Feature("take", "1")), (-1.0, -1.0), (1.0, 1.0))


def predicate(name, feature, value=1.0):
    def margin(state, drawers):
        return 0.1 - np.abs(state.stack(drawers, feature) - value)

    return Predicate.threshold(name, (DRAWER,), margin)


OPEN, CLOSED = predicate("Open", "open"), predicate("Closed", "open", 0.0)
INSIDE, HELD = predicate("Inside", "inside"), predicate("Held", "held")
STANDING = predicate("Standing", "vase")


def operator(name, needs, adds, deletes):
    sets = (frozenset(LiftedAtom(one, (D,)) for one in some) for some in (needs, adds, deletes))
    return LiftedOperator(name, (D,), *sets)


OPERATORS = (
    operator("Pull", (CLOSED, INSIDE), (OPEN,), (CLOSED,)),
    operator("Push", (OPEN, INSIDE), (CLOSED,), (OPEN,)),
    operator("Take", (OPEN, INSIDE), (HELD,), (INSIDE,)),
    operator("Raise", (HELD,), (STANDING,), ()),
)


class DrawerWorld:
    """Is pulled, pushed, or reached into."""

    def __init__(self, state: State) -> None:
        self.state = state

    def reset(self, state: State) -> None:
        self.state = state

    def step(self, action: np.ndarray) -> State:
        now = dict(zip(FEATURES, self.state[THE_DRAWER].tolist(), strict=True))
        pull, take = action
        if pull > 0.0:
            now["open"], now["opened"] = 1.0, now["opened"] + 1.0
            now["vase"] *= 1.0 - now["shaky"]
        elif pull < 0.0:
            now["open"] = 0.0
        if take > 0.0:
            now["held"] = float(now["opened"] >= now["front"])
            now["inside"] = 0.0
        elif take < 0.0:
            now["vase"] = 1.0
        self.state = State(LAYOUT, [now[name] for name in FEATURES])
        return self.state


@dataclass(frozen=True)
class OneAction:
    """Does one thing for one step."""

    name: str
    action: tuple[float, float]
    step_limit: int = 1
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        return 1

    def start(self, state, objects):
        return lambda _: np.array(self.action)


SKILLS = (
    OneAction("Pull", (1, 0)),
    OneAction("Push", (-1, 0)),
    OneAction("Take", (0, 1)),
    OneAction("Raise", (0, -1)),
)


def drawer(front, shaky=False):
    """The domain, and a task whose ball comes to the front when the drawer is opened so often."""
    state = State(LAYOUT, [0.0, 1.0, 0.0, 0.0, float(front), 1.0, float(shaky)])
    task = Task(state, frozenset({HELD(THE_DRAWER)}), 20)
    domain = Domain(
        name="drawer",
        preset="default",
        types=(DRAWER,),
        predicates=(OPEN, CLOSED, INSIDE, HELD, STANDING),
        action_space=ACTIONS,
        sample_task=lambda rng: task,
        make_world=DrawerWorld,
        default_goal=lambda state: task.goal,
        step_limit=20,
        execution=Execution(0.05),
        operators=OPERATORS,
        skills={skill.name: skill for skill in SKILLS},
        exact=False,
    )
    return domain, task


@pytest.mark.parametrize("planner", ["lazy", "exhaustive"])
@pytest.mark.parametrize(
    ("front", "expected"),
    [(1, ["Pull", "Take"]), (2, ["Pull", "Push", "Pull", "Take"])],
)
def test_a_plan_comes_back_to_an_abstract_state_where_no_other_is_left(planner, front, expected):
    domain, task = drawer(front)
    episode = solve(domain, task, PURE_PLANNING, planner)
    assert episode.success and episode.replans == 0
    assert [edge.option for edge in episode.edges] == expected


def test_a_detour_is_no_plan_that_fails():
    domain, task = drawer(2)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    result = make_planner("lazy", domain, task.initial_state).plan(task.initial_state, goal)
    assert not result.fails
    assert (len(result.plan.edges), result.plan.predicted_steps) == (4, 4)
    assert result.edges_rolled_out == 5  # Pull, Take; Push, Pull, Take


def test_a_detour_has_so_many_operators_and_no_more():
    domain, task = drawer(3)
    episode = solve(domain, task, PURE_PLANNING)
    assert (episode.success, episode.error.code) == (False, ErrorCode.UNSOLVABLE)
    assert "Take(drawer) ended after 1 steps with Held(drawer) missing" in episode.error.reason


def test_skills_that_do_exactly_what_operators_say_need_none():
    """Where nothing but what operators say changes, the way to a skill does not matter."""
    domain, task = drawer(2)
    episode = solve(replace(domain, exact=True), task, PURE_PLANNING)
    assert episode.error.code is ErrorCode.UNSOLVABLE


def test_an_unrolled_graph_has_every_sequence_up_to_a_length():
    domain, task = drawer(1)
    operators = Problem.of(domain, task.initial_state).operators
    space = domain.atom_space(task.initial_state)
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    for length, sequences in ((2, 1), (3, 1), (4, 2), (6, 3)):
        graph = build_unrolled_graph(start, goal, operators, length)
        assert all(edge.source < edge.target for edge in graph.edges)
        ways = [1] + [0] * (len(graph.nodes) - 1)
        for edge in graph.edges:
            ways[edge.target] += ways[edge.source]
        assert sum(ways[node] for node in graph.goal_nodes) == sequences
    with pytest.raises(UnsolvableError, match="the goal holds in none"):
        build_unrolled_graph(start, goal, operators, 1)


@pytest.mark.parametrize("planner", ["lazy", "exhaustive"])
@pytest.mark.parametrize(
    ("goal", "expected"),
    [((HELD,), ["Pull", "Take"]), ((HELD, STANDING), ["Pull", "Take", "Raise"])],
)
def test_a_side_effect_that_does_not_prevent_the_goal_is_planned_for(planner, goal, expected):
    domain, task = drawer(1, shaky=True)
    domain = replace(domain, exact=True)
    task = replace(task, goal=frozenset(atom(THE_DRAWER) for atom in goal))
    episode = solve(domain, task, PURE_PLANNING, planner)
    assert episode.success and episode.replans == 0
    assert [edge.option for edge in episode.edges] == expected
    space = domain.atom_space(task.initial_state)
    result = make_planner(planner, domain, task.initial_state).plan(
        task.initial_state, space.mask(task.goal)
    )
    pull = result.plan.edges[0]
    assert not result.fails and pull.target.exact
    assert set(space.decode(pull.target.required)) == {OPEN(THE_DRAWER), INSIDE(THE_DRAWER)}


def test_a_side_effect_after_which_planning_takes_too_long_is_left_alone():
    """There is more to try, and an error of its own that says why nothing led to the goal."""
    domain, task = drawer(1, shaky=True)
    state, space = task.initial_state, domain.atom_space(task.initial_state)
    goal = space.mask(atom(THE_DRAWER) for atom in (HELD, STANDING))
    planner = GraphPlanner(Problem.of(replace(domain, exact=True), state))
    graph, outcome = planner.search_to(state, goal)
    recovery = Recovery(planner.problem, graph, state, goal, outcome.failed)

    def too_long(state, goal):
        raise PlanningLimitError("too many abstract states")

    assert recovery.past_side_effect(planner.search_to) is not None
    assert recovery.past_side_effect(too_long) is None


def test_a_side_effect_that_prevents_the_goal_leaves_no_plan():
    domain, task = drawer(1, shaky=True)
    task = replace(task, goal=frozenset(atom(THE_DRAWER) for atom in (OPEN, INSIDE, STANDING)))
    episode = solve(replace(domain, exact=True), task, PURE_PLANNING)
    assert episode.error.code is ErrorCode.UNSOLVABLE
    assert "Pull(drawer) ended after 1 steps with Standing(drawer) missing" in episode.error.reason
