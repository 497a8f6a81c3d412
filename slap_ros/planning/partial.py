# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planning without the objects that are not detected (SLAP D.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from slap_ros.errors import NoDetectionError
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.planning.planner import ImprovingPlanner, Planner
from slap_ros.relational import AtomSpace, Layout, State


@dataclass
class PartialPlanner:
    """Plans from states that lack some of a task's objects.

    Goals and plans have the atoms of the whole task. Those about an object that is not detected
    are false in every abstract state of a plan.

    Args:
        space: The atoms of the whole task.
        atoms_of: The atoms over the objects of a state.
        make: A planner over the objects of a state.
    """

    space: AtomSpace
    atoms_of: Callable[[State], AtomSpace]
    make: Callable[[State], Planner]
    _planners: dict[Layout, Planner] = field(default_factory=dict, init=False, repr=False)

    def prepare(self, state: State) -> None:
        """Make the planner for these objects, which takes time, before it is needed."""
        if state.layout not in self._planners:
            self._planners[state.layout] = self.make(state)

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`~slap_ros.planning.planner.Planner`.

        Raises:
            NoDetectionError: The goal is about an object that is not detected.
        """
        self.prepare(state)
        planner = self._planners[state.layout]
        if state.layout == self.space.layout:
            return planner.plan(state, goal)
        self._require_detected(state, goal)
        known = self.atoms_of(state)
        result = planner.plan(state, self.space.project(goal, known))
        edges = (
            replace(edge, target=edge.target.projected(known, self.space))
            for edge in result.plan.edges
        )
        return replace(result, plan=Plan(tuple(edges)))

    def improve_rest(
        self, planned: PlanningResult, number: int, state: State, goal: int
    ) -> PlanningResult | None:
        """See :class:`~slap_ros.planning.planner.ImprovingPlanner`; None unless all is detected."""
        planner = self._planners.get(state.layout)
        if state.layout != self.space.layout or not isinstance(planner, ImprovingPlanner):
            return None
        return planner.improve_rest(planned, number, state, goal)

    def _require_detected(self, state: State, goal: int) -> None:
        known = set(state.objects)
        missing = sorted(
            {o.name for atom in self.space.decode(goal) for o in atom.objects if o not in known}
        )
        if missing:
            raise NoDetectionError(f"the goal is about what is not detected: {', '.join(missing)}")
