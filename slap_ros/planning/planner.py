# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planners by name: from a state and a goal to a plan."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.planning.ff_planner import FFPlanner
from slap_ros.planning.graph_planner import GraphPlanner, ShortcutSource
from slap_ros.planning.plan import PlanningResult
from slap_ros.planning.problem import Problem
from slap_ros.planning.search import search_exhaustively
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


def _lazy(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    return GraphPlanner(problem, shortcuts=shortcuts)


def _exhaustive(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    return GraphPlanner(problem, search_exhaustively, shortcuts=shortcuts)


def _ff(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner ff plans without shortcuts; use lazy")
    return FFPlanner(problem)


def _astar(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner astar plans without shortcuts; use lazy")
    return SymbolicPlanner(problem.model.space, problem.operators, problem.unskilled)


PLANNERS: Mapping[str, Callable[[Problem, ShortcutSource | None], Planner]] = {
    "lazy": _lazy,
    "exhaustive": _exhaustive,
    "ff": _ff,
    "astar": _astar,
}
WITH_SHORTCUTS = ("lazy", "exhaustive")  # planners that can use them


def make_planner(
    name: str, domain: Domain, initial: State, shortcuts: ShortcutSource | None = None
) -> Planner:
    """A planner by name.

    Args:
        name: One of ``PLANNERS``.
        domain: For whose tasks.
        initial: A state with the objects of the tasks.
        shortcuts: Where shortcut edges come from; None for pure planning.

    Returns:
        The planner, with a model of its own.

    Raises:
        InvalidParameterError: No planner of that name, or none that can use shortcuts.
        NoSkillsError: The domain has no operators.
    """
    if name not in PLANNERS:
        raise InvalidParameterError(f"unknown planner {name!r}; there are {', '.join(PLANNERS)}")
    return PLANNERS[name](Problem.of(domain, initial), shortcuts)
