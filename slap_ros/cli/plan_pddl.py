# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan`` with two PDDL files; needs no domain, no shortcuts and no pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from slap_ros.cli.console import console, print_json, print_result
from slap_ros.errors import InvalidParameterError, PlanningLimitError, UnsolvableError
from slap_ros.files import read_bytes, reason_of
from slap_ros.planning.greedy import find_plan
from slap_ros.relational.articles import counted
from slap_ros.relational.pddl import PddlDomain, PddlProblem, parse_domain, parse_problem
from slap_ros.relational.pddl.ground_task import GroundTask
from slap_ros.relational.pddl.grounder import MAX_BINDINGS, ground_task
from slap_ros.relational.pddl.tokens import decode

OTHER_PLANNERS = "up:"  # engines of unified-planning, by name
PLANNERS = ("anytime", "lazy", "ff", "astar")  # anytime and lazy: ff, then cheaper plans


@dataclass(frozen=True)
class PddlPlan:
    """A plan as it is printed.

    Args:
        steps: Operators with their objects, each as in ``(drive truck depot shop)``.
        cost: What they cost; None where the problem asks for no least cost.
        is_cheapest: Whether it is proven that no plan has fewer operators or, where costs count,
            costs less.
    """

    steps: tuple[str, ...]
    cost: float | None
    is_cheapest: bool = False

    def __str__(self) -> str:
        """How many operators, and what they cost."""
        count = counted(len(self.steps), "operator")
        if self.cost is None:
            return f"{count}, the fewest" if self.is_cheapest else count
        known = "the least" if self.is_cheapest else "not proven to be the least"
        return f"{count}, cost {self.cost:.15g}, {known}"

    def lines(self) -> list[str]:
        """The plan as planners of competitions write it and validators read it."""
        cost, kind = (len(self.steps), "unit") if self.cost is None else (self.cost, "general")
        return [*self.steps, f"; cost = {cost:.15g} ({kind} cost)"]


def plan_pddl(domain_file: Path, problem_file: Path, planner: str, effort: int, json: bool) -> None:
    """Plan with the FF heuristic, or as asked for, and print the operators.

    Args:
        domain_file: PDDL domain; it may have the problem as well.
        problem_file: PDDL problem of that domain.
        planner: Name of the planner.
        effort: Factor of the limits of planning.
        json: Whether stdout gets JSON.

    Raises:
        InvalidParameterError: A file cannot be read, or there is no such planner.
        InvalidDomainError: What is in it is not understood.
        UnsolvableError: The goal cannot be reached.
        PlanningLimitError: A limit was reached first.
    """
    if planner.startswith(OTHER_PLANNERS):
        # Not above: unified-planning is an extra.
        from slap_ros.cli.unified_planning import plan_with_engine

        engine = planner.removeprefix(OTHER_PLANNERS)
        found = plan_with_engine(read_pddl(domain_file), read_pddl(problem_file), engine)
    else:
        domain = parse_domain(read_pddl(domain_file), str(domain_file))
        problem = parse_problem(read_pddl(problem_file), domain, str(problem_file))
        try:
            found = find_pddl_plan(domain, problem, planner, effort)
        except PlanningLimitError as error:
            raise PlanningLimitError(
                f"{error}; --effort {10 * effort} allows ten times as much"
            ) from error
    if json:
        costs = {} if found.cost is None else {"cost": found.cost}
        print_json({"plan": list(found.steps)} | costs)
        return
    for line in found.lines():
        print_result(line)
    console.print(str(found))


def find_pddl_plan(
    domain: PddlDomain, problem: PddlProblem, planner: str = "anytime", effort: int = 1
) -> PddlPlan:
    """A plan for a PDDL problem.

    Args:
        domain: Types, predicates and operators.
        problem: Objects, start and goal.
        planner: ``ff`` finds some plan fast. ``anytime`` and ``lazy`` make it cheaper where the
            problem asks for least cost. ``astar`` finds a plan of least cost, or of the fewest
            operators.
        effort: Factor of the limits of planning.

    Raises:
        InvalidParameterError: There is no such planner.
        UnsolvableError: The goal cannot be reached.
        PlanningLimitError: A limit was reached first.
    """
    if effort < 1:
        raise InvalidParameterError(f"the effort of planning must be 1 at least, got {effort}")
    if planner not in PLANNERS:
        raise InvalidParameterError(
            f"unknown planner {planner!r} for PDDL files; there are {', '.join(PLANNERS)} and "
            f"{OTHER_PLANNERS}NAME"
        )
    task = ground_task(domain, problem, effort * MAX_BINDINGS)
    try:
        actions, is_cheapest = _search(task, planner, effort, problem.minimises_cost)
    except UnsolvableError as error:
        raise UnsolvableError(f"{error}{_left_out(task)}") from error
    cost = sum(task.actions[index].cost for index in actions)
    steps = tuple(task.actions[index].name for index in actions)
    return PddlPlan(steps, cost if problem.minimises_cost else None, is_cheapest)


def _search(
    task: GroundTask, planner: str, effort: int, minimises_cost: bool
) -> tuple[Sequence[int], bool]:
    """Indices of the plan's actions, and whether no plan is cheaper."""
    if planner == "astar":
        from slap_ros.planning.least_cost import find_cheapest_plan

        return find_cheapest_plan(task, effort).actions, True
    actions = find_plan(task, effort)
    if not minimises_cost or planner == "ff":
        return actions, not actions
    from slap_ros.planning.least_cost import make_cheaper

    best = make_cheaper(task, actions, effort)
    return best.actions, best.is_cheapest


def _left_out(task: GroundTask) -> str:
    """Which operators had no cost, in words; empty for none."""
    if not task.without_cost:
        return ""
    first, *others = task.without_cost
    more = f" and {len(others)} more" if others else ""
    return f"; left out, as :init does not give what their cost is made of: {first}{more}"


def read_pddl(path: Path) -> str:
    """The text of a PDDL file in any encoding.

    Raises:
        InvalidParameterError: It cannot be read.
    """
    try:
        return decode(read_bytes(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidParameterError(f"cannot read {path}: {reason_of(error)}") from error
