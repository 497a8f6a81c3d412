# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of operators alone, by A*: nothing is rolled out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from slap_ros.errors import UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult
from slap_ros.planning.problem import GroundedOptions, why_unreachable
from slap_ros.relational import AtomSpace, GroundOperator, State


def plan_symbolically(
    space: AtomSpace,
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    unskilled: Sequence[GroundOperator] = (),
) -> list[int]:
    """A shortest sequence of operators, by A*; see :mod:`slap_ros.planning.astar`.

    Args:
        space: The task's atoms.
        start: The abstract state to start from, a mask.
        goal: Mask of atoms that must hold.
        operators: Over that space.
        unskilled: Others over it that lack a skill, for messages.

    Returns:
        Indices into ``operators``.

    Raises:
        UnsolvableError: No sequence leads to the goal; the message says which atoms are missing.
        PlanningLimitError: None was found within the limit of abstract states.
    """
    try:
        return find_shortest_sequence(start, goal, operators)
    except UnsolvableError as error:
        why = why_unreachable(space, start, goal, operators, unskilled)
        raise UnsolvableError(f"{error}: {why}") from error


@dataclass(frozen=True)
class SymbolicPlanner:
    """A shortest sequence of operators, by A*; nothing is rolled out in a model.

    Where a rollout takes as long as doing it, doing it and planning again is as good; and a plan is
    wanted before its skills can be had.

    Args:
        space: The task's atoms.
        options: The operators over its objects.
        unskilled: Operators that lack a skill, for messages.
    """

    space: AtomSpace
    options: GroundedOptions
    unskilled: tuple[GroundOperator, ...] = ()

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`; a skill counts with its least steps."""
        edges = self.edges(self.space.abstract(state), goal)
        return PlanningResult(Plan(tuple(edges)), len(edges) + 1, len(edges), 0)

    def edges(self, abstract: int, goal: int) -> list[PlanEdge]:
        """The plan from an abstract state to a goal, both masks.

        Raises:
            UnsolvableError: There is none.
            PlanningLimitError: None was found within the limit of abstract states.
        """
        grounds, edges = [ground for ground, _ in self.options], []
        for number in plan_symbolically(self.space, abstract, goal, grounds, self.unskilled):
            ground, option = self.options[number]
            abstract = ground.apply(abstract)
            edges.append(PlanEdge(option, option.target(abstract), option.skill.least_steps))
        return edges
