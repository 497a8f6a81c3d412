# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans at any time: what is proven of them holds, and efforts are kept to."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import slap_ros
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import Edge
from slap_ros.planning.anytime import AnytimePlanner, PlanningInterrupted
from slap_ros.planning.corridor import Corridor
from slap_ros.planning.effort import Effort
from slap_ros.planning.landmark_cut import LandmarkCut, RelaxedOperator
from slap_ros.planning.lazy_search import SearchLimits, search_lazily
from slap_ros.planning.model import Rollout
from slap_ros.planning.mutexes import may_hold_together
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan import bound_as_text
from slap_ros.planning.planner import make_planner
from slap_ros.planning.problem import Problem
from slap_ros.planning.relaxation import bits
from slap_ros.planning.search import search_exhaustively
from slap_ros.relational import State
from slap_ros.shortcuts.grounded_shortcuts import GroundedShortcuts
from slap_ros.shortcuts.shipped import chosen_library
from support.cheapest_plans import cheapest
from support.marks import slow
from test.planning.test_search import LAYOUT, MadeUpModel, MadeUpSkill, made_up_graphs


class RememberingModel(MadeUpModel):
    """Counts each roll-out once, as the planner's model does."""

    def __init__(self):
        super().__init__()
        self.known = set()

    def knows(self, option, state, target):
        return (option, target, state.key) in self.known

    def roll_out(self, option, state, target):
        if self.knows(option, state, target):
            self.executed -= 1
        self.known.add((option, target, state.key))
        return super().roll_out(option, state, target)


START = State(LAYOUT, [0.0])


@settings(max_examples=200, deadline=None)
@given(made_up_graphs(), st.sampled_from([1.0, 1.5, 3.0, 30.0]))
def test_a_weighted_search_is_too_long_by_its_weight_at_most(graph, weight):
    best = search_exhaustively(graph, START, MadeUpModel()).plan
    outcome = search_lazily(graph, START, MadeUpModel(), SearchLimits(weight))
    if best is None:
        assert outcome.plan is None
        return
    assert best.predicted_steps <= outcome.plan.predicted_steps <= weight * best.predicted_steps
    assert outcome.at_least <= best.predicted_steps
    if weight == 1.0:
        assert outcome.at_least == best.predicted_steps


@settings(max_examples=200, deadline=None)
@given(made_up_graphs(), st.integers(0, 12), st.integers(1, 60))
def test_a_search_that_stops_says_no_more_than_is_true(graph, rollouts, below):
    best = search_exhaustively(graph, START, MadeUpModel()).plan
    model = RememberingModel()
    outcome = search_lazily(graph, START, model, SearchLimits(1.0, rollouts, below))
    assert model.executed <= rollouts
    if best is not None:
        assert outcome.at_least <= best.predicted_steps or outcome.at_least == below
        if not outcome.stopped and best.predicted_steps < below:
            assert outcome.plan.predicted_steps == best.predicted_steps


@st.composite
def relaxed_problems(draw):
    atoms = st.integers(0, 6)
    masks = st.sets(atoms, max_size=2).map(lambda bits: sum(1 << bit for bit in bits))
    operators = draw(st.lists(st.tuples(masks, masks, st.integers(1, 5)), min_size=1, max_size=10))
    return draw(masks), draw(masks), [RelaxedOperator(*one) for one in operators]


def without_deletes(one, state):
    """What comes of an operator that deletes nothing."""
    return [state | one.add_effects]


@settings(max_examples=300, deadline=None)
@given(relaxed_problems())
def test_landmarks_never_count_more_than_the_cheapest_plan(problem):
    start, goal, operators = problem
    bound = LandmarkCut(goal, operators)(start)
    truth = cheapest(start, goal, operators, without_deletes)
    assert (bound is None) == (truth is None)
    if truth is not None:
        assert bound <= truth
        assert (bound == 0) == (truth == 0)


@pytest.mark.parametrize(("shortcuts", "tasks"), [(False, 10), *slow((True, 1))])
def test_small_problems_are_solved_as_lazy_search_solves_them(shortcuts, tasks):
    domain = get_domain("obstacle2d")
    library = chosen_library("" if shortcuts else "none", domain)
    for index in range(tasks):
        task = domain.task(7, index)
        goal = domain.atom_space(task.initial_state).mask(task.goal)
        known = library and GroundedShortcuts(domain, library.shortcuts, task.initial_state)
        found = [
            make_planner(name, domain, task.initial_state, known).plan(task.initial_state, goal)
            for name in ("anytime", "lazy")
        ]
        assert found[0].steps == found[1].steps
        assert [one.bound for one in found] == [1.0, 1.0]


def test_a_shortcut_that_failed_in_one_search_is_tried_elsewhere_in_the_next():
    """Here a search with a weight comes to three states first in which the shortcut fails."""
    domain = get_domain("obstacle_tower", "fair")
    task, library = domain.task(511), chosen_library(None, domain)
    steps = []
    for planner in ("lazy", "anytime"):
        shortcuts = GroundedShortcuts(domain, library.shortcuts, task.initial_state)
        made = make_planner(planner, domain, task.initial_state, shortcuts)
        goal = domain.atom_space(task.initial_state).mask(task.goal)
        found = made.plan(task.initial_state, goal)
        assert planner == "lazy" or found.bound == 1.0
        steps.append(found.steps)
    assert steps[0] == steps[1] < 100


@given(st.integers(1, 500), st.integers(0, 2000))
def test_a_bound_as_text_is_a_bound_and_1_00_is_a_proof(least, more):
    bound = (least + more) / least
    text = bound_as_text(bound)
    assert len(text.partition(".")[2]) == 2
    assert bound - 1e-7 <= float(text) < bound + 0.01
    assert (text == "1.00") == (more == 0)


def improvements(domain, task, effort, library=None):
    problem = Problem.of(domain, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    shortcuts = library and GroundedShortcuts(domain, library.shortcuts, task.initial_state)
    planner = AnytimePlanner(problem, shortcuts, effort)
    return list(planner.improve(task.initial_state, goal))


class EverNewModel(MadeUpModel):
    """Each roll-out ends where none has been, and the goal is never reached."""

    def knows(self, option, state, target):
        return False

    def roll_out(self, option, state, target):
        self.executed += 1
        return Rollout(option.skill.name != "to_goal", 1, State(LAYOUT, [float(self.executed)]))


def test_a_plan_is_not_made_shorter_by_going_round():
    """It would never end: where it comes back to, it has not been in this low-level state."""
    goal, model = 1 << 20, EverNewModel()
    graph = Corridor(goal, nodes=[1, 2, goal], depth=[0, 0, 0])
    for name, source, target in (("up", 0, 1), ("down", 1, 0), ("to_goal", 1, 2)):
        option = Option(OptionKind.OPERATOR, MadeUpSkill(name, 0, 0.0), ())
        graph.edges.append(Edge(source, target, option))
    outcome = search_lazily(graph, START, model, SearchLimits(rollouts=50, below=100))
    assert (outcome.plan, outcome.stopped) == (None, False)
    assert model.executed == 2
    outcome = search_lazily(graph, START, model, SearchLimits(rollouts=50))
    assert outcome.stopped  # a first plan may need it


def test_what_no_operators_in_a_row_can_do_is_planned_for_by_going_round(monkeypatch):
    """The tower's top cannot be grasped before the red block was put down elsewhere.

    Not by fingers that close where they were to go, as here: the hand pushes it on its way.
    """
    monkeypatch.setattr("slap_ros.domains.tabletop.skills.AIM_STEPS", 0)
    domain = get_domain("obstacle_tower", "fair:obstacles=8")
    task = domain.task(502)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    plan = make_planner("anytime", domain, task.initial_state).plan(task.initial_state, goal).plan
    names = [edge.option.skill.name for edge in plan.edges]
    assert names[:2] == ["Pick", "Place"]
    assert len(names) > 18


def test_a_tall_tower_is_planned_for_within_the_effort_and_each_plan_is_better():
    domain = slap_ros.make("obstacle_tower", obstacles=6)
    task, effort = domain.task(seed=1), Effort(rollouts=12, tests=10_000)
    found = improvements(domain, task, effort, chosen_library("", domain))
    steps, proven = [one.steps for one in found], [one.at_least for one in found]
    assert steps == sorted(steps, reverse=True)
    assert proven == sorted(proven)
    assert steps[-1] < 0.4 * steps[0]  # the slap clears towers that are taller than in training
    assert found[-1].edges_rolled_out <= found[0].edges_rolled_out + 12 // 4
    run = slap_ros.execute(domain, task, found[-1])
    assert run.success
    assert run.steps == steps[-1]


@pytest.mark.slow
def test_a_shortcut_does_what_operators_cannot(monkeypatch):
    """This tower sways, so that fingers cannot grasp its top that close where they were to go."""
    monkeypatch.setattr("slap_ros.domains.tabletop.skills.AIM_STEPS", 0)
    domain = slap_ros.make("obstacle_tower", obstacles=8)
    task, effort = domain.task(seed=502), Effort(rollouts=60)
    with pytest.raises(PlanningLimitError, match="no plan within the effort of planning"):
        improvements(domain, task, effort)
    (*_, last) = improvements(domain, task, effort, chosen_library("", domain))
    assert slap_ros.execute(domain, task, last).success


def test_the_same_plan_comes_of_the_same_effort():
    domain = slap_ros.make("cleanup_table", toys=4)
    task, effort = domain.task(3), Effort(rollouts=30)
    once, again = (improvements(domain, task, effort)[-1] for _ in range(2))
    assert once.plan == again.plan
    assert once.edges_rolled_out == again.edges_rolled_out <= 30
    assert 1.0 < once.bound < 10.0  # there was no time to prove more


def test_planning_ends_when_a_plan_is_good_enough():
    domain = slap_ros.make("cleanup_table", toys=4)
    task = domain.task(3)
    goal = domain.atom_space(task.initial_state).mask(task.goal)
    planner = make_planner("anytime:within=10", domain, task.initial_state)
    result = planner.plan(task.initial_state, goal)
    assert 1.0 < result.bound <= 10.0
    assert result.edges_rolled_out < 30


class InterruptedWorld:
    """A domain's world in which Ctrl-C comes after so many steps."""

    def __init__(self, world, steps):
        self._world, self._left = world, steps

    def __getattr__(self, name):
        return getattr(self._world, name)

    def step(self, action):
        self._left -= 1
        if self._left < 0:
            raise KeyboardInterrupt
        return self._world.step(action)


def test_an_interrupt_leaves_the_best_plan_so_far():
    domain = slap_ros.make("obstacle_tower", obstacles=4)
    task = domain.task(3)
    first = improvements(domain, task, Effort(rollouts=1))[0]
    problem = Problem.of(domain, task.initial_state)
    goal = problem.model.space.mask(task.goal)
    problem.model._world = InterruptedWorld(problem.model._world, first.steps + 20)
    with pytest.raises(PlanningInterrupted) as caught:
        AnytimePlanner(problem).plan(task.initial_state, goal)
    assert caught.value.best.plan == first.plan
    problem.model._world._left = 0
    with pytest.raises(KeyboardInterrupt) as early:
        AnytimePlanner(problem).plan(domain.task(4).initial_state, goal)
    assert not isinstance(early.value, PlanningInterrupted)


@pytest.mark.parametrize("obstacles", [2, 8])
def test_what_never_holds_together_is_named(obstacles):
    domain = slap_ros.make("obstacle_tower", obstacles=obstacles)
    task = domain.task(seed=1)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    both = space.mask([space.atom("Holding", ["robot", f"block{i}"]) for i in (1, 2)])
    words = "Holding.robot, block1., Holding.robot, block2. never hold together"
    with pytest.raises(UnsolvableError, match=words):
        AnytimePlanner(problem).plan(task.initial_state, both)
    assert problem.model.executed == 0


def reachable(start, operators):
    states, todo = {start}, [start]
    while todo:
        state = todo.pop()
        fresh = {one.apply(state) for one in operators if one.applicable(state)} - states
        states |= fresh
        todo += fresh
    return states


def test_two_atoms_that_hold_together_are_never_said_not_to():
    domain = get_domain("obstacle2d")
    for seed in range(3):
        problem = Problem.of(domain, domain.task(seed).initial_state)
        start = problem.model.space.abstract(domain.task(seed).initial_state)
        operators = [ground for ground, _ in problem.operators]
        together = may_hold_together(start, operators)
        for state in reachable(start, operators):
            for atom in bits(state):
                assert state & ~together[atom] == 0
        pairs = sum(mask.bit_count() for mask in together.values())
        assert pairs < len(together) ** 2  # something is excluded


@pytest.mark.parametrize(
    ("planner", "words"),
    [
        ("anytime:within=0.9", "within must be 1 at least, got 0.9"),
        ("anytime:within=nan", "within must be 1 at least, got nan"),
        ("anytime:effort=0", "effort of planning must be 1 at least, got 0"),
        ("anytime:effort=half", "invalid literal"),
        ("anytime:improve=-1", "improve must be 0 at least, got -1"),
        ("anytime:speed=3", "unknown setting 'speed'; there are within, effort, improve"),
        ("anytime:within", "'within' is not of the form setting=value"),
        ("lazy:within=1.5", "only anytime has settings"),
        ("dijkstra", "unknown planner 'dijkstra'; there are anytime, lazy, "),
    ],
)
def test_what_makes_no_sense_is_refused_with_what_there_is(planner, words):
    domain = get_domain("obstacle2d")
    with pytest.raises(InvalidParameterError, match=words):
        make_planner(planner, domain, domain.task(0).initial_state)
