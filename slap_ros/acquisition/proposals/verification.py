# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators judged together: is there a plan, and if not, why not (LG-SAIL §4.1).

The paper feeds back the operators that cannot be reached. That is not enough: its own printed
operators of PegInHole can all be reached, and each goal atom too, but never both, since nothing
gives HandEmpty back. So all abstract states are enumerated where they are few enough, and what is
said is what was seen there: preconditions that are never true, cycles, goal atoms that are never
reached or never together, and what is taken away for good.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice, permutations

from slap_ros.acquisition.proposals.complaints import Complaint, ComplaintClass
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.relational import (
    GroundAtom,
    GroundOperator,
    LiftedAtom,
    LiftedOperator,
    Predicate,
    Variable,
    ground_operators,
)

# A model may answer with operators of thousands of groundings, each of which is looked at in every
# abstract state. So the work is bounded, to some seconds, and not the states alone.
MAX_WORK = 10_000_000  # ground operators looked at, in all states together
MAX_STATES = 20_000  # abstract states
MAX_PREDICATES = 8  # number of predicates for which a plan without deletions is tried
MAX_COMPARED = 6  # parameters of operators that are compared in every order
SUBJECT = "operators"


@dataclass(frozen=True)
class Verification:
    """The result of a verification.

    Args:
        plan: Shortest plan; None where there is none.
        complaints: Complaints that say why there is no plan; warnings where there is one.
        culprits: Names of operators to be asked for again, in order; none where there is a plan.
    """

    plan: tuple[GroundOperator, ...] | None
    complaints: tuple[Complaint, ...]
    culprits: tuple[str, ...]


def verify(operators: Sequence[LiftedOperator], problem: AcquisitionProblem) -> Verification:
    """Whether the operators, each sound by itself, make a plan for the problem."""
    if duplicates := _duplicates(operators):
        complaints, culprits = duplicates
        return Verification(None, complaints, culprits)
    try:
        grounded = ground_operators(operators, problem.space)
        sequence = find_shortest_sequence(
            problem.start_mask, problem.goal_mask, grounded, _most_states(grounded)
        )
    except PlanningLimitError as error:
        complaint = Complaint(ComplaintClass.TOO_LARGE, SUBJECT, str(error))
        return Verification(None, (complaint,), tuple(op.name for op in operators))
    except UnsolvableError:
        return _Diagnosis(operators, grounded, problem).verdict()
    unused = _Diagnosis(operators, grounded, problem).never_applicable()
    warnings = tuple(replace(one.complaint, warning=True) for one in unused)
    return Verification(tuple(grounded[i] for i in sequence), warnings, ())


@dataclass(frozen=True)
class _Culprits:
    """A complaint, and the names of the operators that are to be asked for again."""

    complaint: Complaint
    operators: frozenset[str]

    @classmethod
    def of(cls, kind: ComplaintClass, fact: str, *operators: str) -> _Culprits:
        subject = f"operator {' and '.join(operators)}" if operators else SUBJECT
        return cls(Complaint(kind, subject, fact), frozenset(operators))


@dataclass(frozen=True)
class _Exploration:
    """The abstract states that can be reached from the initial one."""

    states: frozenset[int]
    ever_true: int  # mask: atoms that hold in one of them
    complete: bool  # whether these are all; else ever_true is what deleting nothing would give

    @classmethod
    def of(cls, start: int, operators: Sequence[GroundOperator]) -> _Exploration:
        found, queue = {start}, deque([start])
        ever_true, most = start, _most_states(operators)
        while queue:
            state = queue.popleft()
            for operator in operators:
                if not operator.applicable(state):
                    continue
                successor = operator.apply(state)
                if successor not in found:
                    if len(found) == most:
                        return cls(frozenset(found), _relaxed(start, operators), False)
                    found.add(successor)
                    queue.append(successor)
                    ever_true |= successor
        return cls(frozenset(found), ever_true, True)


def _most_states(operators: Sequence[GroundOperator]) -> int:
    return min(MAX_STATES, MAX_WORK // max(1, len(operators)))


def _relaxed(start: int, operators: Sequence[GroundOperator]) -> int:
    """The atoms that could be reached if nothing were ever deleted."""
    reached, before = start, -1
    while reached != before:
        before = reached
        for operator in operators:
            if operator.applicable(reached):
                reached |= operator.add_effects
    return reached


class _Diagnosis:
    """Why operators make no plan."""

    def __init__(
        self,
        operators: Sequence[LiftedOperator],
        grounded: Sequence[GroundOperator],
        problem: AcquisitionProblem,
    ) -> None:
        self._operators = operators
        self._problem = problem
        self._grounded = grounded
        self._seen = _Exploration.of(problem.start_mask, grounded)
        self._groundings: dict[str, list[GroundOperator]] = {op.name: [] for op in operators}
        for operator in grounded:
            self._groundings[operator.operator.name].append(operator)
        self._never = [op for op in operators if not self._ever_applicable(op)]

    def verdict(self) -> Verification:
        """All complaints, and the operators to be asked for again."""
        never, goals = self.never_applicable(), self._goal_culprits()
        at_fault = [one.operators for one in never] or [goals.operators]
        names = [op.name for op in self._operators]
        chosen = frozenset().union(*at_fault) or set(names)
        ordered = tuple(name for name in names if name in chosen)
        complaints = (*(one.complaint for one in never), goals.complaint)
        return Verification(None, complaints, ordered)

    # -- operators that can never be applied ------------------------------------------------------

    def _ever_applicable(self, operator: LiftedOperator) -> bool:
        groundings = self._groundings[operator.name]
        if not self._seen.complete:
            return any(g.applicable(self._seen.ever_true) for g in groundings)
        possible = [g for g in groundings if g.applicable(self._seen.ever_true)]
        return any(g.applicable(state) for g in possible for state in self._seen.states)

    def never_applicable(self) -> list[_Culprits]:
        """What is wrong with each operator that can never be applied, and each cycle of them."""
        needs = {op.name: self._missing(op) for op in self._never}
        never = set(needs)
        found, waits = [], {}
        for operator in self._never:
            missing = needs[operator.name]
            producers = {op.name for atom in missing for op in self._producers(atom)}
            waits[operator.name] = producers & never
            if fact := self._never_true(operator, missing):
                kind = ComplaintClass.PRECONDITION_NEVER_TRUE
                found.append(_Culprits.of(kind, fact, operator.name))
        return found + self._cycles(waits, needs)

    def _missing(self, operator: LiftedOperator) -> list[LiftedAtom]:
        """The preconditions that hold of no objects, ever."""
        return [
            atom
            for atom in _ordered(operator.preconditions)
            if not self._instances(atom) & self._seen.ever_true
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

    def _producers(self, atom: LiftedAtom) -> list[LiftedOperator]:
        return [
            op
            for op in self._operators
            if any(added.predicate == atom.predicate for added in op.add_effects)
        ]

    def _never_true(self, operator: LiftedOperator, missing: Sequence[LiftedAtom]) -> str:
        """Which preconditions of an operator cannot be had, by its own fault; else empty."""
        unreachable = [
            atom for atom in missing if not any(op in self._never for op in self._producers(atom))
        ]
        if unreachable:
            reasons = (
                f"{atom} is required, but it does not hold of fitting objects at first, and "
                + (
                    "no action adds it"
                    if not self._producers(atom)
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
        pairs = MAX_WORK // (len(groundings) * len(self._seen.states)) + 1
        for pair in islice(combinations(atoms, 2), pairs):
            masks = {self._mask(pair, operator, g) for g in groundings}
            if not any(state & mask == mask for mask in masks for state in self._seen.states):
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
            if one.predicate in _predicates(op.delete_effects)
            and other.predicate in _predicates(op.add_effects)
        ]
        return f": {', '.join(words)}" if words else ""

    def _cycles(
        self, waits: dict[str, set[str]], needs: dict[str, list[LiftedAtom]]
    ) -> list[_Culprits]:
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
            found.append(_Culprits.of(ComplaintClass.CIRCULAR_PRECONDITIONS, fact, *cycle))
        return found

    # -- the goal ---------------------------------------------------------------------------------

    def _goal_culprits(self) -> _Culprits:
        unreachable = [
            atom
            for atom in self._problem.space.decode(self._problem.goal_mask)
            if not self._problem.space.bit(atom) & self._seen.ever_true
        ]
        kind = ComplaintClass.GOAL_UNREACHABLE
        if unreachable:
            facts = "; ".join(map(self._unreachable_fact, unreachable))
            return _Culprits.of(kind, f"no plan reaches the goal: {facts}")
        if not self._seen.complete:
            fact = "no plan reaches the goal, though each atom could hold if nothing were deleted"
            return _Culprits.of(kind, fact)
        return self._never_together()

    def _unreachable_fact(self, atom: GroundAtom) -> str:
        lifted = LiftedAtom(
            atom.predicate,
            tuple(Variable(f"?{i}", obj.type) for i, obj in enumerate(atom.objects)),
        )
        producers = self._producers(lifted)
        if not producers:
            return f"{atom} is never true: no action adds {atom.predicate.name}"
        names = " and ".join(op.name for op in producers)
        possible = (
            "is never possible" if all(op in self._never for op in producers) else "never does so"
        )
        return f"{atom} is never true: {names} could add it, but {possible}"

    def _never_together(self) -> _Culprits:
        """Each goal atom can be reached, all of them cannot: what is lost on the way?"""
        goal = self._problem.goal_mask
        best = max(self._seen.states, key=lambda s: ((s & goal).bit_count(), -s))
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
        return _Culprits(complaint, frozenset(at_fault))

    def _never_restored(self) -> dict[str, list[LiftedOperator]]:
        """Predicates that operators need and delete but never add, with who deletes them."""
        needed = {p for op in self._operators for p in _predicates(op.preconditions)}
        added = {p for op in self._operators for p in _predicates(op.add_effects)}
        lost: dict[str, list[LiftedOperator]] = {}
        for op in self._operators:
            for predicate in sorted(_predicates(op.delete_effects) & needed - added, key=str):
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
                _most_states(changed),
            )
        except (UnsolvableError, PlanningLimitError):
            return False
        return True

    def _asked_again(self, deleters: Sequence[LiftedOperator]) -> set[str]:
        """Who should give back what others take: those that end what these begin, else these.

        Insert deletes Holding, which Pick adds as it deletes HandEmpty: so Insert is asked again.
        """
        begun = {p for op in deleters for p in _predicates(op.add_effects)}
        ending = {
            op.name
            for op in self._operators
            if op not in deleters and _predicates(op.delete_effects) & begun
        }
        return ending or {op.name for op in deleters}


def _duplicates(
    operators: Sequence[LiftedOperator],
) -> tuple[tuple[Complaint, ...], tuple[str, ...]] | None:
    """Operators of one name, or that say the same of other variables."""
    for i, one in enumerate(operators):
        for other in operators[:i]:
            if one.name.lower() == other.name.lower():
                fact = f"two operators are named {one.name}"
            elif _same(one, other):
                fact = f"{one.name} and {other.name} need and change the same"
            else:
                continue
            complaint = Complaint(ComplaintClass.DUPLICATE, f"operator {one.name}", fact)
            return (complaint,), (one.name,)
    return None


def _same(one: LiftedOperator, other: LiftedOperator) -> bool:
    """Whether two operators are the same up to their variables' names and order."""
    if len(one.parameters) != len(other.parameters) or len(one.parameters) > MAX_COMPARED:
        return False
    wanted = _parts(other, {v: i for i, v in enumerate(other.parameters)})
    return any(
        all(v.type == w.type for v, w in zip(order, other.parameters, strict=True))
        and _parts(one, {v: i for i, v in enumerate(order)}) == wanted
        for order in permutations(one.parameters)
    )


def _parts(operator: LiftedOperator, numbers: dict[Variable, int]) -> list[frozenset[object]]:
    """PRE, EFF+, EFF- and what must differ, with numbers for variables."""
    differ = (frozenset((numbers[one], numbers[other])) for one, other in operator.inequalities)
    return [
        frozenset(differ),
        *(
            frozenset((atom.predicate, tuple(numbers[v] for v in atom.variables)) for atom in atoms)
            for atoms in (operator.preconditions, operator.add_effects, operator.delete_effects)
        ),
    ]


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


def _predicates(atoms: Iterable[LiftedAtom]) -> set[Predicate]:
    return {atom.predicate for atom in atoms}


def _ordered(atoms: Iterable[LiftedAtom]) -> list[LiftedAtom]:
    return sorted(atoms, key=str)
