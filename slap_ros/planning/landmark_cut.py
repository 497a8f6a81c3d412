# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lower bound of the environment steps to a goal, from masks alone: LM-cut.

M. Helmert, C. Domshlak: Landmarks, Critical Paths and Abstractions: What's the Difference Anyway?,
ICAPS 2009. Operators delete nothing. Again and again, a set of operators is found of which every
plan needs one; the cheapest of them is counted, and taken off the cost of all. The sum is
admissible, and at least what h_max gives.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_

from slap_ros.planning.relaxation import bits

_INFINITE = 1 << 60


@dataclass(frozen=True)
class RelaxedOperator:
    """What an option may need and add, and the environment steps that it takes at least.

    Args:
        preconditions: Atoms that must hold, a mask.
        add_effects: Atoms that it may add, a mask.
        least_steps: Environment steps that it takes at least.
        deletes: Atoms that it deletes, a mask, if exactly its effects come of it; None where it may
            add less and delete anything. LM-cut does not need it.
    """

    preconditions: int
    add_effects: int
    least_steps: int
    deletes: int | None = None


class LandmarkCut:
    """The bound for one goal. Atoms are numbers of bits, with two more for start and goal."""

    def __init__(self, goal: int, operators: Sequence[RelaxedOperator]) -> None:
        """Prepare the lists of what needs and what adds each atom.

        Args:
            goal: Mask of atoms that must hold.
            operators: Relaxed operators.
        """
        masks = [goal, *(o.preconditions | o.add_effects for o in operators)]
        size = max(mask.bit_length() for mask in masks)
        self._start, self._goal = size, size + 1
        self._needed = reduce(or_, [goal, *(o.preconditions for o in operators)])
        self._needs = [bits(o.preconditions) or [self._start] for o in operators]
        self._needs.append(bits(goal) or [self._start])
        self._adds = [bits(o.add_effects & ~o.preconditions) for o in operators]
        self._adds.append([self._goal])
        self._costs = [*(o.least_steps for o in operators), 0]
        self._needed_by = _inverse(self._needs, size + 2)
        self._added_by = _inverse(self._adds, size + 2)

    def __call__(self, abstract: int) -> int | None:
        """Environment steps to the goal at least; None where it is out of reach.

        Args:
            abstract: Abstract state to start from, a mask.
        """
        start = [*bits(abstract & self._needed), self._start]
        costs, total = list(self._costs), 0
        while True:
            value, supporter = self._h_max(start, costs)
            if value[self._goal] == _INFINITE:
                return None
            if value[self._goal] == 0:
                return total
            cut = self._cut(start, costs, supporter)
            least = min(costs[one] for one in cut)
            for one in cut:
                costs[one] -= least
            total += least

    def _h_max(self, start: list[int], costs: list[int]) -> tuple[list[int], list[int | None]]:
        """The h_max value of each atom, and the dearest precondition of each operator."""
        value = [_INFINITE] * (self._goal + 1)
        missing = [len(needs) for needs in self._needs]
        supporter: list[int | None] = [None] * len(costs)
        for atom in start:
            value[atom] = 0
        queue, closed = [(0, atom) for atom in sorted(start)], [False] * len(value)
        while queue:
            reached, atom = heapq.heappop(queue)
            if closed[atom]:
                continue
            closed[atom] = True
            for operator in self._needed_by[atom]:
                missing[operator] -= 1
                if missing[operator] == 0:
                    supporter[operator] = atom
                    through = reached + costs[operator]
                    for added in self._adds[operator]:
                        if through < value[added]:
                            value[added] = through
                            heapq.heappush(queue, (through, added))
        return value, supporter

    def _cut(
        self, start: list[int], costs: list[int], supporter: Sequence[int | None]
    ) -> list[int]:
        """The operators that lead into the atoms from which the goal costs nothing more."""
        free = self._goal_zone(costs, supporter)
        seen, stack, cut = set(start), list(start), []
        while stack:
            atom = stack.pop()
            for operator in self._needed_by[atom]:
                if supporter[operator] != atom:
                    continue
                added = self._adds[operator]
                if any(one in free for one in added):
                    cut.append(operator)
                    continue
                fresh = [one for one in added if one not in seen]
                seen.update(fresh)
                stack += fresh
        return cut

    def _goal_zone(self, costs: list[int], supporter: Sequence[int | None]) -> set[int]:
        zone, stack = {self._goal}, [self._goal]
        while stack:
            for operator in self._added_by[stack.pop()]:
                before = supporter[operator]
                if before is not None and costs[operator] == 0 and before not in zone:
                    zone.add(before)
                    stack.append(before)
        return zone


def _inverse(rows: Sequence[Sequence[int]], size: int) -> list[list[int]]:
    """The indices of the rows in which each number is."""
    found: list[list[int]] = [[] for _ in range(size)]
    for index, row in enumerate(rows):
        for number in row:
            found[number].append(index)
    return found
