# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ground PDDL tasks in which operators delete nothing: what it costs to reach each atom.

Costs are relaxed in rounds (Bellman and Ford): first of all operators at once, then of those whose
preconditions became cheaper. numpy does each round in a few calls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.relational.pddl.ground_task import GroundTask

Costs = NDArray[np.float64]
Indices = NDArray[np.intp]
Truth = NDArray[np.bool_]


@dataclass(frozen=True)
class _Operators:
    """Relaxed operators: effects of actions, and alternatives of disjunctions."""

    needed: list[list[int]]  # bits
    added: list[list[int]]
    costs: list[float]
    actions: list[int]  # indices; -1 for disjunctions


class RelaxedTask:
    """The relaxed operators of a task, as arrays.

    Two bits are put behind those of the task: one that is always set, as the precondition of what
    has none, and one that nobody asks about, as the effect of what has no more.
    """

    def __init__(self, task: GroundTask, costs: Sequence[float]) -> None:
        """Prepare the arrays.

        Args:
            task: Task whose operators are relaxed.
            costs: Costs of its actions, as a heuristic shall see them.
        """
        operators = _relax(task, costs)
        self.size = task.size
        self.goal = np.array(bits(task.goal), dtype=np.intp)
        self.costs = np.array(operators.costs, dtype=np.float64)
        self.action = np.array(operators.actions, dtype=np.intp)
        self.needed = operators.needed
        self.adders = _Table.inverse(operators.added, task.size)
        self.tests = 0  # of operators so far
        self._needs = _padded(operators.needed, task.size)
        self._adds = _padded(operators.added, task.size + 1)
        self._takers = _Table.inverse(operators.needed, task.size)
        self._bytes = (task.size + 9) // 8
        self._preconditions = _padded([bits(a.precondition) for a in task.actions], task.size)

    def truth(self, state: int) -> Truth:
        """Whether each bit of a state is set."""
        packed = np.frombuffer(state.to_bytes(self._bytes, "little"), dtype=np.uint8)
        truth = np.unpackbits(packed, count=self.size + 2, bitorder="little").view(np.bool_)
        truth[self.size] = True
        return truth

    def applicable(self, truth: Truth) -> Indices:
        """Indices of the actions whose preconditions hold."""
        return np.flatnonzero(truth[self._preconditions].all(axis=1))

    def reach(self, truth: Truth, combine: np.ufunc) -> tuple[Costs, Costs]:
        """What it costs to reach all atoms, and to apply all operators; infinite where impossible.

        Args:
            truth: State to start from, from :meth:`truth`.
            combine: How costs of preconditions make the cost of an operator: ``np.add`` for h_add,
                ``np.maximum`` for h_max.
        """
        atoms = np.where(truth, 0.0, np.inf)
        self.tests += len(self.costs)
        operators = combine.reduce(atoms[self._needs], axis=1) + self.costs
        cheaper = np.flatnonzero(np.isfinite(operators))
        while len(cheaper):
            before = atoms[: self.size].copy()
            targets = self._adds[cheaper]
            np.minimum.at(atoms, targets, operators[cheaper, np.newaxis])
            changed = np.flatnonzero(atoms[: self.size] < before)
            cheaper = self._takers.of(changed)
            self.tests += len(cheaper)
            costs = combine.reduce(atoms[self._needs[cheaper]], axis=1) + self.costs[cheaper]
            lower = costs < operators[cheaper]
            cheaper = cheaper[lower]
            operators[cheaper] = costs[lower]
        return atoms, operators


@dataclass(frozen=True)
class _Table:
    """Which operators have each bit: all in one array, and where those of a bit begin and end."""

    operators: Indices
    start: Indices
    end: Indices

    @classmethod
    def inverse(cls, rows: Sequence[Sequence[int]], size: int) -> _Table:
        """The table of operators given by their bits."""
        lists: list[list[int]] = [[] for _ in range(size)]
        for number, row in enumerate(rows):
            for bit in row:
                lists[bit].append(number)
        end = np.cumsum([len(found) for found in lists], dtype=np.intp)
        start = end - np.array([len(found) for found in lists], dtype=np.intp)
        return cls(np.array([n for found in lists for n in found], dtype=np.intp), start, end)

    def of(self, chosen: Indices) -> Indices:
        """The operators of several bits; one that has several of them comes several times."""
        lengths = self.end[chosen] - self.start[chosen]
        ends = np.cumsum(lengths)
        total = int(ends[-1]) if len(ends) else 0
        shift = np.repeat(self.start[chosen] - (ends - lengths), lengths)
        return self.operators[shift + np.arange(total)]


def _relax(task: GroundTask, costs: Sequence[float]) -> _Operators:
    found = _Operators([], [], [], [])

    def add(needed: int, added: int, cost: float, action: int) -> None:
        if added & ~needed:
            found.needed.append(bits(needed))
            found.added.append(bits(added & ~needed))
            found.costs.append(cost)
            found.actions.append(action)

    for number, action in enumerate(task.actions):
        for effect in action.effects:
            turned_on = (effect.deleted & ~effect.added & task.complemented) << 1
            needed = action.precondition | effect.condition
            add(needed, effect.added | turned_on, costs[number], number)
    for disjunction in task.disjunctions:
        for alternative in disjunction.alternatives:
            add(alternative, disjunction.bit, 0.0, -1)
    return found


def _padded(rows: Sequence[Sequence[int]], filler: int) -> Indices:
    """Rows of numbers as an array, filled up at the end."""
    width = max([1, *map(len, rows)])
    array = np.full((len(rows), width), filler, dtype=np.intp)
    for number, row in enumerate(rows):
        array[number, : len(row)] = row
    return array


def bits(mask: int) -> list[int]:
    """Numbers of the bits that are set, in order."""
    found = []
    while mask:
        low = mask & -mask
        found.append(low.bit_length() - 1)
        mask ^= low
    return found
