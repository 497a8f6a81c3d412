# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators that can never be applied, and why: what they need is never true."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations, islice, permutations

from slap_ros.acquisition.proposals.complaints import ComplaintClass
from slap_ros.acquisition.proposals.culprits import Culprits
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.reachable_states import MAX_WORK, ReachableStates
from slap_ros.relational import GroundOperator, LiftedAtom, LiftedOperator, Predicate


class ImpossibleOperators:
    """Finds them among the operators for a problem."""

    def __init__(
        self,
        operators: Sequence[LiftedOperator],
        grounded: Sequence[GroundOperator],
        problem: AcquisitionProblem,
        reached: ReachableStates,
    ) -> None:
        """Look at every operator.

        Args:
            operators: Operators, each sound by itself.
            grounded: The same, ground.
            problem: Problem that they are for.
            reached: Abstract states that they reach.
        """
        self._operators, self._problem, self._reached = operators, problem, reached
        self._groundings: dict[str, list[GroundOperator]] = {op.name: [] for op in operators}
        for operator in grounded:
            self._groundings[operator.operator.name].append(operator)
        self.never = [op for op in operators if not self._ever_applicable(op)]

    def _ever_applicable(self, operator: LiftedOperator) -> bool:
        groundings = self._groundings[operator.name]
        if not self._reached.complete:
            return any(g.applicable(self._reached.ever_true) for g in groundings)
        possible = [g for g in groundings if g.applicable(self._reached.ever_true)]
        return any(g.applicable(state) for g in possible for state in self._reached.states)

    def culprits(self) -> list[Culprits]:
        """What is wrong with each operator that can never be applied, and each cycle of them."""
        needs = {op.name: self._missing(op) for op in self.never}
        never = set(needs)
        found, waits = [], {}
        for operator in self.never:
            missing = needs[operator.name]
            producers = {op.name for atom in missing for op in self.producers(atom)}
            waits[operator.name] = producers & never
            if fact := self._never_true(operator, missing):
                kind = ComplaintClass.PRECONDITION_NEVER_TRUE
                found.append(Culprits.of(kind, fact, operator.name))
        return found + self._cycles(waits, needs)

    def _missing(self, operator: LiftedOperator) -> list[LiftedAtom]:
        """The preconditions that hold of no objects, ever."""
        return [
            atom
            for atom in _ordered(operator.preconditions)
            if not self._instances(atom) & self._reached.ever_true
        ]

    def _instances(self, atom: LiftedAtom) -> int:
        """Mask of the ground atoms that an atom of typed variables can stand for."""
        space = self._problem.space
        return sum(
            space.bit(ground)
            for ground in space.atoms
            if ground.predicate == atom.predicate
            and all(
                obj.type.is_a(variable.type)
                for obj, variable in zip(ground.objects, atom.variables, strict=True)
            )
        )

    def producers(self, atom: LiftedAtom) -> list[LiftedOperator]:
        """The operators that add atoms of the same predicate."""
        return [
            op
            for op in self._operators
            if any(added.predicate == atom.predicate for added in op.add_effects)
        ]

    def _never_true(self, operator: LiftedOperator, missing: Sequence[LiftedAtom]) -> str:
        """Which preconditions of an operator cannot be had, by its own fault; else empty."""
        unreachable = [
            atom for atom in missing if not any(op in self.never for op in self.producers(atom))
        ]
        if unreachable:
            reasons = (
                f"{atom} is required, but it does not hold of fitting objects at first, and "
                + (
                    "no action adds it"
                    if not self.producers(atom)
                    else "none that is possible adds it"
                )
                for atom in unreachable
            )
            return "; ".join(reasons)
        return "" if missing else self._conflict(operator)

    def _conflict(self, operator: LiftedOperator) -> str:
        """Which preconditions are true, but never together."""
        groundings = self._groundings[operator.name]
        if not groundings:
            return "its preconditions that nothing changes hold of no choice of objects together"
        atoms = _ordered(operator.preconditions)
        # Only so many pairs can be compared: each with each grounding, in each state.
        pairs = MAX_WORK // (len(groundings) * len(self._reached.states)) + 1
        for pair in islice(combinations(atoms, 2), pairs):
            masks = {self._mask(pair, operator, g) for g in groundings}
            if not any(state & mask == mask for mask in masks for state in self._reached.states):
                deleters = self._deleters(pair)
                return f"{pair[0]} and {pair[1]} are required, but never true together{deleters}"
        return f"{', '.join(map(str, atoms))} are required, but never all true together"

    def _mask(
        self, atoms: Iterable[LiftedAtom], operator: LiftedOperator, grounding: GroundOperator
    ) -> int:
        binding = dict(zip(operator.parameters, grounding.objects, strict=True))
        return self._problem.space.mask(atom.ground(binding) for atom in atoms)

    def _deleters(self, pair: Sequence[LiftedAtom]) -> str:
        """Which actions delete one atom as they add the other."""
        words = [
            f"{op.name} deletes {one.predicate.name} when it adds {other.predicate.name}"
            for op in self._operators
            for one, other in permutations(pair)
            if one.predicate in predicates_of(op.delete_effects)
            and other.predicate in predicates_of(op.add_effects)
        ]
        return f": {', '.join(words)}" if words else ""

    def _cycles(
        self, waits: dict[str, set[str]], needs: dict[str, list[LiftedAtom]]
    ) -> list[Culprits]:
        """What is wrong with each set of operators that wait for one another."""
        reach = {name: _closure(name, waits) for name in waits}
        cycles: list[list[str]] = []
        for name in waits:
            cycle = sorted(other for other in reach[name] if name in reach[other])
            if name in cycle and cycle not in cycles:
                cycles.append(cycle)
        found = []
        for cycle in cycles:
            parts = (f"{name} needs {', '.join(map(str, needs[name]))}" for name in cycle)
            fact = f"{'; '.join(parts)}; only {' and '.join(cycle)} could make that true"
            found.append(Culprits.of(ComplaintClass.CIRCULAR_PRECONDITIONS, fact, *cycle))
        return found


def _closure(name: str, edges: dict[str, set[str]]) -> set[str]:
    """What can be reached from a node in one step or more."""
    found: set[str] = set()
    queue = [name]
    while queue:
        for successor in edges.get(queue.pop(), ()):
            if successor not in found:
                found.add(successor)
                queue.append(successor)
    return found


def predicates_of(atoms: Iterable[LiftedAtom]) -> set[Predicate]:
    """The predicates of some atoms."""
    return {atom.predicate for atom in atoms}


def _ordered(atoms: Iterable[LiftedAtom]) -> list[LiftedAtom]:
    return sorted(atoms, key=str)
