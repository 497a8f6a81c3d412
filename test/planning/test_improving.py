# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning goes on while the robot moves: the rest of a plan gets shorter, the same every time."""

from functools import cache
from itertools import pairwise

import pytest

from slap_ros.api.execution import Run
from slap_ros.bags import evaluate_bag
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidStateError
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.effort import Effort
from slap_ros.planning.execution import Executor
from slap_ros.planning.planner import ImprovingPlanner, make_planner
from slap_ros.planning.problem import Problem
from slap_ros.relational import Target
from slap_ros.report import read_report

DOMAIN = get_domain("obstacle_tower", "fair:obstacles=4")
TASK = DOMAIN.task(304)
SPACE = DOMAIN.atom_space(TASK.initial_state)
GOAL = SPACE.mask(TASK.goal)
LITTLE = 12, 10_000  # roll-outs and tests: too few to search the whole graph


def planner(improve):
    """A planner whose first plans are far from the shortest."""
    return AnytimePlanner(Problem.of(DOMAIN, TASK.initial_state), None, Effort(*LITTLE, 1, improve))


def solve(by):
    world = DOMAIN.make_world(TASK.initial_state)
    return Executor(DOMAIN, by, world, SPACE, GOAL, TASK.step_limit).run()


@cache
def improved():
    return solve(planner(improve=4))


def test_what_is_executed_is_shorter_than_the_first_plan():
    as_planned, episode = solve(planner(improve=0)), improved()
    first = episode.plans[0].planned
    assert as_planned.success and as_planned.plan_length == first.steps
    assert episode.success and episode.plan_length < first.steps
    assert episode.replans == 0  # nothing diverged
    assert len(as_planned.plans) == 1 < len(episode.plans)


def test_each_rest_is_shorter_than_the_one_that_it_replaces_and_goes_on_from_there():
    plans = improved().plans
    assert [one.improves for one in plans] == [False] + [True] * (len(plans) - 1)
    for before, after in pairwise(plans):
        done, rest = len(before.steps), before.planned.plan.edges[len(before.steps) :]
        assert done > 0
        assert after.planned.steps < sum(edge.predicted_steps for edge in rest)
        assert after.first_step == before.first_step + sum(before.steps)
    assert len(plans[-1].steps) == len(plans[-1].planned.plan.edges)


def test_it_is_the_same_whatever_was_planned_before():
    used = planner(improve=4)
    once, again = solve(used), solve(used)
    assert [s.key for s in once.states] == [s.key for s in again.states]
    assert [s.key for s in once.states] == [s.key for s in improved().states]


def test_a_plan_that_is_proven_or_good_enough_is_left_alone():
    small = get_domain("obstacle2d")
    task = small.task(0)
    thorough = make_planner("anytime", small, task.initial_state)
    goal = small.atom_space(task.initial_state).mask(task.goal)
    proven = thorough.plan(task.initial_state, goal)
    assert proven.is_proven
    simulated = thorough.problem.model.executed
    assert thorough.improve_rest(proven, 0, task.initial_state, goal) is None
    assert thorough.problem.model.executed == simulated

    state = TASK.initial_state
    content = make_planner("anytime:within=100", DOMAIN, state)
    assert content.improve_rest(planner(0).plan(state, GOAL), 0, state, GOAL) is None
    assert content.problem.model.executed == 0


def test_where_the_model_refuses_what_is_perceived_the_plan_is_left_alone():
    state, by = TASK.initial_state, planner(improve=4)
    one, other = (obj for obj in state.objects if obj.name in ("block1", "block2"))
    inside = state.replace({(other, axis): float(state.get(one, axis)) for axis in "xyz"})
    planned = by.plan(state, GOAL)
    with pytest.raises(InvalidStateError, match="are inside one another"):
        by.problem.model.roll_out(planned.plan.edges[0].option, inside, Target.exactly(0))
    assert by.improve_rest(planned, 0, inside, GOAL) is None


def test_the_other_planners_have_nothing_to_improve():
    assert not isinstance(make_planner("lazy", DOMAIN, TASK.initial_state), ImprovingPlanner)


def test_a_bag_tells_the_same_and_lacks_nothing(tmp_path):
    episode = improved()
    Run(DOMAIN, TASK, episode).bag(tmp_path / "bag")
    evaluation = evaluate_bag(tmp_path / "bag")
    (run,) = evaluation.runs
    assert (evaluation.damage, evaluation.mismatches) == (None, [])
    assert (run.success, run.plan_length, run.replans) == (True, episode.plan_length, 0)
    assert run.edges_rolled_out == episode.edges_rolled_out
    assert run.planning_seconds == pytest.approx(episode.planning_seconds, abs=1e-8)
    assert [option.steps for option in run.options] == [edge.steps for edge in episode.edges]
    (told,) = read_report(tmp_path / "bag").runs
    rests = [(one.first_step, one.planned.steps) for one in episode.plans[1:]]
    assert [(one.step, one.predicted_steps) for one in told.improvements] == rests
    assert told.replan_steps == ()
