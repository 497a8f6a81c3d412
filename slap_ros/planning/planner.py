# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planners by name: from a state and a goal to a plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.planning.anytime import AnytimePlanner
from slap_ros.planning.effort import Effort
from slap_ros.planning.ff_planner import FFPlanner
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.options import never
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.planner_choice import PlannerChoice
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.planning.symbolic_planner import SymbolicPlanner
from slap_ros.relational import State


class Planner(Protocol):
    """Plans for tasks over one set of objects."""

    def plan(self, state: State, goal: int) -> PlanningResult:
        """Plan from ``state`` to where the atoms of ``goal``, a mask, hold.

        Raises:
            UnsolvableError: There is no plan.
            PlanningLimitError: A limit was reached first.
        """
        ...


@runtime_checkable
class ImprovingPlanner(Planner, Protocol):
    """Looks for a shorter rest of a plan while the robot executes it."""

    def improve_rest(
        self, planned: PlanningResult, number: int, state: State, goal: int
    ) -> PlanningResult | None:
        """A shorter rest of a plan, from where one of its edges leads in the model.

        How much is searched for it depends on how long that edge takes in the model, and not on
        time: so it is the same however fast the robot and the computer are.

        Args:
            planned: Plan under execution.
            number: Index of the edge that is being executed.
            state: State in which the edge began.
            goal: Mask of the atoms that the plan is to reach.

        Returns:
            The rest; None where none was found that is shorter, or the plan is good enough.
        """
        ...


Make = Callable[[Problem, ShortcutSource | None, Effort], Planner]


def _lazy(problem: Problem, shortcuts: ShortcutSource | None, _: Effort) -> Planner:
    return GraphPlanner(problem, shortcuts=shortcuts)


def _exhaustive(problem: Problem, shortcuts: ShortcutSource | None, _: Effort) -> Planner:
    return GraphPlanner(problem, search_exhaustively, shortcuts=shortcuts)


def _anytime(problem: Problem, shortcuts: ShortcutSource | None, effort: Effort) -> Planner:
    return AnytimePlanner(problem, shortcuts, effort)


def _ff(problem: Problem, shortcuts: ShortcutSource | None, _: Effort) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner ff plans without shortcuts; use anytime")
    return FFPlanner(problem)


def _astar(problem: Problem, shortcuts: ShortcutSource | None, _: Effort) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner astar plans without shortcuts; use anytime")
    return SymbolicPlanner(problem.model.space, problem.operators, problem.unskilled)


PLANNERS: Mapping[str, Make] = {
    "anytime": _anytime,
    "lazy": _lazy,
    "exhaustive": _exhaustive,
    "ff": _ff,
    "astar": _astar,
}


def make_planner(
    planner: str,
    domain: Domain,
    initial: State,
    shortcuts: ShortcutSource | None = None,
    is_canceled: Callable[[], bool] = never,
) -> Planner:
    """A planner by name.

    Args:
        planner: One of ``PLANNERS``; ``anytime`` with settings, as in ``anytime:within=1.25``.
        domain: For whose tasks.
        initial: A state with the objects of the tasks.
        shortcuts: Where shortcut edges come from; None for pure planning.
        is_canceled: Whether nobody wants a plan any more; then its search ends with a
            TaskCanceledError.

    Returns:
        The planner, with a model of its own.

    Raises:
        InvalidParameterError: No planner of that name, none that can use shortcuts, or no such
            settings.
        NoSkillsError: The domain has no operators.
    """
    choice = require_planner(planner)
    return PLANNERS[choice.name](Problem.of(domain, initial, is_canceled), shortcuts, choice.effort)


def require_planner(planner: str) -> PlannerChoice:
    """The choice of a planner that there is.

    Raises:
        InvalidParameterError: No planner of that name, or no such settings.
    """
    choice = PlannerChoice.parse(planner)
    if choice.name not in PLANNERS:
        raise InvalidParameterError(
            f"unknown planner {choice.name!r}; there are {', '.join(PLANNERS)}"
        )
    return choice
