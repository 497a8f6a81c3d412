# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A goal that operators do not reach, and why: atoms of it never hold, or never together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass
from slap_ros.acquisition.proposals.culprits import SUBJECT, Culprits
from slap_ros.acquisition.proposals.impossible_operators import ImpossibleOperators, predicates_of
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.reachable_states import ReachableStates, most_states
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.relational import (
    GroundAtom,
    GroundOperator,
    LiftedAtom,
    LiftedOperator,
    Variable,
)

MAX_PREDICATES = 8  # number of predicates for which a plan without deletions is tried


class UnreachableGoal:
    """Says why no plan of operators reaches the goal of a problem."""

    def __init__(
        self,
        operators: Sequence[LiftedOperator],
        grounded: Sequence[GroundOperator],
        problem: AcquisitionProblem,
        reached: ReachableStates,
        impossible: ImpossibleOperators,
    ) -> None:
        """Look at nothing yet.

        Args:
            operators: Operators, which make no plan.
            grounded: The same, ground.
            problem: Problem that they are for.
            reached: Abstract states that they reach.
            impossible: Those of them that can never be applied.
        """
        self._operators, self._grounded, self._problem = operators, grounded, problem
        self._reached, self._impossible = reached, impossible

    def culprits(self) -> Culprits:
        """What keeps the goal from being reached, and who is at fault."""
        unreachable = [
            atom
            for atom in self._problem.space.decode(self._problem.goal_mask)
            if not self._problem.space.bit(atom) & self._reached.ever_true
        ]
        kind = ComplaintClass.GOAL_UNREACHABLE
        if unreachable:
            facts = "; ".join(map(self._unreachable_fact, unreachable))
            return Culprits.of(kind, f"no plan reaches the goal: {facts}")
        if not self._reached.complete:
            fact = "no plan reaches the goal, though each atom could hold if nothing were deleted"
            return Culprits.of(kind, fact)
        return self._never_together()

    def _unreachable_fact(self, atom: GroundAtom) -> str:
        lifted = LiftedAtom(
            atom.predicate,
            tuple(Variable(f"?{i}", obj.type) for i, obj in enumerate(atom.objects)),
        )
        producers = self._impossible.producers(lifted)
        if not producers:
            return f"{atom} is never true: no action adds {atom.predicate.name}"
        names = " and ".join(op.name for op in producers)
        never_possible = all(op in self._impossible.never for op in producers)
        possible = "is never possible" if never_possible else "never does so"
        return f"{atom} is never true: {names} could add it, but {possible}"

    def _never_together(self) -> Culprits:
        """Each goal atom can be reached, all of them cannot: what is lost on the way?"""
        goal = self._problem.goal_mask
        best = max(self._reached.states, key=lambda s: ((s & goal).bit_count(), -s))
        reached = ", ".join(map(str, self._problem.space.decode(best & goal))) or "none"
        atoms = ", ".join(map(str, self._problem.space.decode(goal)))
        fact = f"{atoms} can be reached each, but never together; at most {reached}"
        lost = self._never_restored()
        decisive = [name for name in islice(lost, MAX_PREDICATES) if self._would_help(name)]
        parts = []
        for name in decisive or lost:
            deleters = " and ".join(op.name for op in lost[name])
            parts.append(f"{name} is deleted by {deleters} and never added again")
        if parts:
            fact = f"{fact}; {'; '.join(parts)}"
        if decisive:
            fact = f"{fact}; if it were, there would be a plan"
        at_fault = {name for p in decisive or lost for name in self._asked_again(lost[p])}
        complaint = Complaint(ComplaintClass.GOALS_NEVER_TOGETHER, SUBJECT, fact)
        return Culprits(complaint, frozenset(at_fault))

    def _never_restored(self) -> dict[str, list[LiftedOperator]]:
        """Predicates that operators need and delete but never add, with who deletes them."""
        needed = {p for op in self._operators for p in predicates_of(op.preconditions)}
        added = {p for op in self._operators for p in predicates_of(op.add_effects)}
        lost: dict[str, list[LiftedOperator]] = {}
        for op in self._operators:
            for predicate in sorted(predicates_of(op.delete_effects) & needed - added, key=str):
                lost.setdefault(predicate.name, []).append(op)
        return lost

    def _would_help(self, predicate: str) -> bool:
        """Whether there would be a plan if a predicate were never deleted."""
        space = self._problem.space
        kept = ~space.mask(atom for atom in space.atoms if atom.predicate.name == predicate)
        changed = [replace(g, delete_effects=g.delete_effects & kept) for g in self._grounded]
        try:
            find_shortest_sequence(
                self._problem.start_mask,
                self._problem.goal_mask,
                changed,
                most_states(changed),
            )
        except (UnsolvableError, PlanningLimitError):
            return False
        return True

    def _asked_again(self, deleters: Sequence[LiftedOperator]) -> set[str]:
        """Who should give back what others take: those that end what these begin, else these.

        Insert deletes Holding, which Pick adds as it deletes HandEmpty: so Insert is asked again.
        """
        begun = {p for op in deleters for p in predicates_of(op.add_effects)}
        ending = {
            op.name
            for op in self._operators
            if op not in deleters and predicates_of(op.delete_effects) & begun
        }
        return ending or {op.name for op in deleters}
