# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators from demonstrations: cluster what changes, intersect what held before.

No language model is asked, and none is claimed: this needs demonstrations, which a language model
does not. A demonstration is cut where atoms change and stay so; cuts whose changes are alike up to
objects are one operator; its parameters are the objects of the changes, and its preconditions what
held of them (and of no object) before *every* such cut. So it asks for too much rather than for too
little, and further demonstrations can only drop preconditions.

Where atoms are only lost, as those of a closed drawer that is being opened, nothing is cut: with
preconditions and goals that are atoms, an operator that adds nothing is in no shortest plan. It is
a passage to the next change, however long it takes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, count, pairwise, permutations

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal, ProposalProvenance
from slap_ros.acquisition.proposals.proposers import checked
from slap_ros.errors import InvalidParameterError, ProposalRejectedError
from slap_ros.relational import (
    GroundAtom,
    LiftedAtom,
    LiftedOperator,
    Object,
    Predicate,
    Type,
    Variable,
)
from slap_ros.relational.metrics import variable_names

HOLD_STEPS = 3  # environment steps that atoms must stay as they are for a change to count
HOLD_S = 0.3  # time for which atoms must stay as well: steps of some domains are short
MAX_OBJECTS = 6  # objects of one change; more would be compared in too many orders

Trace = Sequence[frozenset[GroundAtom]]  # the atoms that hold, step by step
NumberedAtom = tuple[Predicate, tuple[int, ...]]  # a predicate, and which objects of a change


@dataclass(frozen=True)
class InducedOperator:
    """An operator from demonstrations, and how many changes it is made from.

    Args:
        operator: Operator that is proposed.
        seen: Number of changes that the operator was made from.
        dropped: Preconditions of the first change that did not hold before all others.
    """

    operator: LiftedOperator
    seen: int
    dropped: tuple[str, ...]


class InducedProposer:
    """Operators from the demonstrations of a problem."""

    name = "induced"

    def __init__(self, source: str, hold_steps: int = HOLD_STEPS) -> None:
        """Induce from demonstrations.

        Args:
            source: Description of where the demonstrations are from, for provenance.
            hold_steps: Environment steps that atoms must stay as they are for a change to count.
        """
        self._source = source
        self._hold_steps = hold_steps

    def operators(self, problem: AcquisitionProblem) -> Proposal:
        """The operators, checked; the remarks say how often each was seen.

        Raises:
            ProposalRejectedError: Nothing changes in the demonstrations, or the operators make no
                plan.
        """
        induced = induce_operators(problem.shown, self._hold_steps)
        if not induced:
            raise ProposalRejectedError(
                f"nothing changes in {len(problem.shown)} demonstrations for {self._hold_steps} "
                "steps; record some that solve the task"
            )
        provenance = ProposalProvenance(self.name, source=self._source)
        proposal = checked(tuple(one.operator for one in induced), problem, provenance)
        remarks = (*proposal.remarks, *map(_remark, induced))
        return Proposal(
            proposal.problem, proposal.operators, proposal.plan, provenance, remarks=remarks
        )


def hold_steps_of(control_period_s: float) -> int:
    """Environment steps that atoms must stay as they are, in a domain of that control period."""
    return max(HOLD_STEPS, math.ceil(HOLD_S / control_period_s))


def induce_operators(
    demonstrations: Sequence[Trace], hold_steps: int = HOLD_STEPS
) -> list[InducedOperator]:
    """The operators that demonstrations show, in the order in which they first occur.

    Args:
        demonstrations: Demonstrations of any tasks of one domain.
        hold_steps: Environment steps that atoms must stay as they are for a change to count.

    Returns:
        One operator for each kind of change.

    Raises:
        InvalidParameterError: ``hold_steps`` is below 1.
    """
    clusters: list[_Cluster] = []
    for trace in demonstrations:
        for before, after in pairwise(_without_passages(stable_states(trace, hold_steps))):
            change = _ObservedEffect.of(before, after)
            if len(change.objects) > MAX_OBJECTS:
                continue  # everything at once is no skill
            if not any(cluster.take(change) for cluster in clusters):
                clusters.append(_Cluster(change))
    names = _names(clusters)
    return [cluster.operator(name) for cluster, name in zip(clusters, names, strict=True)]


def stable_states(trace: Trace, hold_steps: int = HOLD_STEPS) -> list[frozenset[GroundAtom]]:
    """The abstract states that last, each once in a row.

    Args:
        trace: Atoms that hold, step by step.
        hold_steps: Environment steps that a state must last, since shorter ones are passages
            between others; but the first and the last count however short, since a recording may
            begin and end anywhere.

    Raises:
        InvalidParameterError: ``hold_steps`` is below 1.
    """
    if hold_steps < 1:
        raise InvalidParameterError(f"atoms must hold for at least 1 step, not {hold_steps}")
    runs: list[tuple[frozenset[GroundAtom], int]] = []
    for atoms in trace:
        if runs and runs[-1][0] == atoms:
            runs[-1] = atoms, runs[-1][1] + 1
        else:
            runs.append((atoms, 1))
    lasting: list[frozenset[GroundAtom]] = []
    for i, (atoms, steps) in enumerate(runs):
        if (steps >= hold_steps or i in (0, len(runs) - 1)) and lasting[-1:] != [atoms]:
            lasting.append(atoms)
    return lasting


def _without_passages(states: Sequence[frozenset[GroundAtom]]) -> list[frozenset[GroundAtom]]:
    """The states but those in which atoms are only lost, the last state excepted."""
    kept = list(states[:1])
    for i, atoms in enumerate(states[1:], start=1):
        if not atoms <= kept[-1] or (i == len(states) - 1 and atoms != kept[-1]):
            kept.append(atoms)
    return kept


@dataclass(frozen=True)
class _ObservedEffect:
    """What changed from one stable state to the next."""

    objects: tuple[Object, ...]  # objects of the changes, in order
    added: frozenset[GroundAtom]
    deleted: frozenset[GroundAtom]
    before: frozenset[GroundAtom]  # atoms before the changes, about these objects or none

    @classmethod
    def of(cls, before: frozenset[GroundAtom], after: frozenset[GroundAtom]) -> _ObservedEffect:
        added, deleted = after - before, before - after
        ordered = [*sorted(added, key=str), *sorted(deleted, key=str)]
        objects = tuple(dict.fromkeys(obj for atom in ordered for obj in atom.objects))
        about = frozenset(atom for atom in before if set(atom.objects) <= set(objects))
        return cls(objects, added, deleted, about)

    @property
    def kind(self) -> tuple[object, ...]:
        """A key that is the same for all changes that may be alike."""
        return (
            sorted(obj.type.name for obj in self.objects),
            sorted(atom.predicate.name for atom in self.added),
            sorted(atom.predicate.name for atom in self.deleted),
        )


class _Cluster:
    """Changes that are alike up to objects."""

    def __init__(self, first: _ObservedEffect) -> None:
        self.kind = first.kind
        self.types: tuple[Type, ...] = tuple(obj.type for obj in first.objects)
        self.added = _numbered(first.added, first.objects)
        self.deleted = _numbered(first.deleted, first.objects)
        self.first_before = _numbered(first.before, first.objects)
        self.before = self.first_before
        self.seen = 1

    def take(self, change: _ObservedEffect) -> bool:
        """Add a change to the cluster, if it is alike."""
        if change.kind != self.kind:
            return False
        for order in self._orders(change.objects):
            if (
                _numbered(change.added, order) == self.added
                and _numbered(change.deleted, order) == self.deleted
            ):
                self.before &= _numbered(change.before, order)
                self.seen += 1
                return True
        return False

    def _orders(self, objects: tuple[Object, ...]) -> Iterator[tuple[Object, ...]]:
        for order in permutations(objects):
            if all(obj.type == kind for obj, kind in zip(order, self.types, strict=True)):
                yield order

    def operator(self, name: str) -> InducedOperator:
        variables = tuple(map(Variable, variable_names(self.types), self.types))

        def lifted(atoms: frozenset[NumberedAtom]) -> frozenset[LiftedAtom]:
            return frozenset(
                LiftedAtom(predicate, tuple(variables[i] for i in numbers))
                for predicate, numbers in atoms
            )

        operator = LiftedOperator(
            name, variables, lifted(self.before), lifted(self.added), lifted(self.deleted)
        )
        dropped = lifted(self.first_before - self.before)
        return InducedOperator(operator, self.seen, tuple(sorted(map(str, dropped))))


def _numbered(atoms: frozenset[GroundAtom], objects: tuple[Object, ...]) -> frozenset[NumberedAtom]:
    """Atoms with numbers for objects."""
    numbers = {obj: i for i, obj in enumerate(objects)}
    return frozenset(
        (atom.predicate, tuple(numbers[obj] for obj in atom.objects)) for atom in atoms
    )


def _names(clusters: Sequence[_Cluster]) -> list[str]:
    """A name for each cluster, after what it achieves; numbered where several do the same."""
    names: list[str] = []
    for cluster in clusters:
        verb, changed = ("Achieve", cluster.added) if cluster.added else ("End", cluster.deleted)
        # What is about most objects says most: In(peg, hole) rather than HandEmpty.
        predicate, _ = min(changed, key=lambda atom: (-len(atom[1]), str(atom[0])))
        name = f"{verb}{predicate}"
        numbered = (f"{name}{number}" for number in count(2))
        names.append(next(free for free in chain((name,), numbered) if free not in names))
    return names


def _remark(induced: InducedOperator) -> str:
    """A remark for people about an induced operator."""
    name = induced.operator.name
    if induced.seen == 1:
        listed = ", ".join(sorted(map(str, induced.operator.preconditions)))
        return f"{name}: seen once; each of its preconditions may be too many: {listed}"
    dropped = f"; dropped {', '.join(induced.dropped)}" if induced.dropped else ""
    return f"{name}: seen {induced.seen} times{dropped}"
