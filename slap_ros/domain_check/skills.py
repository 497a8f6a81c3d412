# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether skills keep what the search relies on: true lower bounds, the same motion again."""

from __future__ import annotations

from collections.abc import Iterator

from slap_ros.core import Domain
from slap_ros.doctor.check import Check
from slap_ros.domain_check.tasks import SolvedTasks
from slap_ros.errors import SlapError
from slap_ros.evaluation.approaches import PURE_PLANNING
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.options import Option
from slap_ros.planning.plan import Plan
from slap_ros.relational import State, Target

PLANS = 10  # tasks whose plans are rolled out again


def lower_bounds(domain: Domain, solved: SolvedTasks) -> Check:
    """Whether no option is done in fewer steps than its skill says that it takes at least."""
    seen = 0
    for option, state, rollout in _rollouts(domain, solved):
        seen += 1
        bound = option.skill.lower_bound(state, option.objects)
        least = option.skill.least_steps
        if rollout.steps < max(bound, least):
            return Check(
                "lower bounds",
                "problem",
                f"{option} took {rollout.steps} steps; its skill says at least "
                f"{max(bound, least)} (lower_bound {bound}, least_steps {least})",
                "a bound that is too high hides the shortest plan from the search: lower it, "
                "least_steps always does",
            )
    return Check("lower bounds", "ok", f"never above the {seen} roll-outs of plans")


def deterministic(domain: Domain, solved: SolvedTasks) -> Check:
    """Whether an option, rolled out again in another world, takes the same way."""
    seen = 0
    for option, state, rollout in _rollouts(domain, solved):
        seen += 1
        again = Model.of(domain, state)
        second = again.roll_out(option, state, Target.exactly(again.space.abstract(rollout.final)))
        if second.steps != rollout.steps or second.final.key != rollout.final.key:
            return Check(
                "skills",
                "problem",
                f"{option} took {rollout.steps} steps, and {second.steps} when it was rolled out "
                "again from the same state",
                "a skill is a function of the state: no clock, no global random numbers, nothing "
                "kept from one start to the next",
            )
    return Check("skills", "ok", f"{seen} roll-outs repeated, to the bit")


def _rollouts(domain: Domain, solved: SolvedTasks) -> Iterator[tuple[Option, State, Rollout]]:
    """Each edge of the plans of some tasks, from the state in which it began."""
    for index in range(min(PLANS, solved.count)):
        if index in solved.failures:
            continue
        task = domain.task(solved.seed, index)
        model = Model.of(domain, task.initial_state)
        state = task.initial_state
        for edge in _plan(domain, state, model.space.mask(task.goal), solved.planner).edges:
            rollout = model.roll_out(edge.option, state, edge.target)
            if not rollout.reached:
                break  # another finding's concern
            yield edge.option, state, rollout
            state = rollout.final


def _plan(domain: Domain, state: State, goal: int, planner: str) -> Plan:
    try:
        return PURE_PLANNING.planner(planner, domain, state).plan(state, goal).plan
    except SlapError:  # solved above, so that this cannot be; then there is nothing to look at
        return Plan(())
