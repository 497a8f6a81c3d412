# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where all has changed that a shortcut may change: the only state to which it is an edge.

A shortcut leads to the abstract states that its signature matches, but for those on the way to
others of them. There are too many to list, in a graph that is too large to be made. But where one
of them has all changes of all others, it is the only end. That takes two proofs, for which
operators are enough, since all nodes are reached by them:

- What is added can hold together with what the shortcut leaves alone (h²).
- What is not replaced by something added cannot be missing: one of a group of atoms holds always,
  and no other of the group may. Groups are grown like fact-alternating mutex groups (D. Fišer,
  A. Komenda: Fact-Alternating Mutex Groups for Classical Planning, JAIR 61, 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from slap_ros.planning.mutexes import Together, may_hold_together
from slap_ros.planning.relaxation import bits
from slap_ros.relational import GroundOperator


class LargestChange:
    """The largest change of abstract states that operators reach from one start."""

    def __init__(self, start: int, operators: Sequence[GroundOperator]) -> None:
        """Prove nothing yet.

        Args:
            start: Abstract state to start from, a mask.
            operators: Ground operators over the same atom space.
        """
        self._start, self._every = start, operators

    def __call__(self, abstract: int, may_be_added: int, left_alone: int) -> int | None:
        """The abstract state whose change has all that others may have; all are masks.

        Args:
            abstract: Abstract state in which the change begins.
            may_be_added: Atoms that the change may add.
            left_alone: Atoms that it neither adds nor deletes.

        Returns:
            The abstract state, which need not be one that operators reach; None where it is not
            proven that any change that they reach is a part of this one.
        """
        added = self._addable(abstract, may_be_added & ~abstract & ~left_alone, left_alone)
        deleted = self._never_with(added) & abstract & ~left_alone
        possible = abstract | added
        kept = abstract & ~left_alone & ~deleted
        if not all(self._must_hold(atom, possible) for atom in bits(kept)):
            return None
        return abstract & ~deleted | added

    def _addable(self, abstract: int, added: int, left_alone: int) -> int:
        """Those of some atoms that may hold together with all that is left alone."""
        for atom in bits(abstract & left_alone):
            added &= self._together.get(atom, 0)
        return added

    def _never_with(self, added: int) -> int:
        """The atoms that never hold together with one of some atoms at least."""
        never = 0
        for atom in bits(added):
            never |= ~self._together.get(atom, 0)
        return never

    def _must_hold(self, atom: int, possible: int) -> bool:
        """Whether an atom holds in each abstract state that has none but possible atoms.

        Args:
            atom: Number of the atom.
            possible: Mask of the possible atoms, this one among them.
        """
        mask = 1 << atom
        # What may stand in for it, the state of a place that is taken while the atom does not hold.
        others = ~possible & ~self._together.get(atom, 0)
        if self._start & mask:
            return self._holds_always(mask, others)
        first = bits(self._start & others)
        return any(self._holds_always(mask | 1 << one, others) for one in first)

    def _holds_always(self, group: int, others: int) -> bool:
        """Whether one of a group of atoms holds always, if some of the others are put to it.

        Args:
            group: Mask of atoms of which one holds at the start.
            others: Mask of the atoms that may be put to it.
        """
        before = 0
        while group != before:
            before = group
            for operator in self._operators:
                if operator.delete_effects & group and not operator.add_effects & group:
                    more = operator.add_effects & others
                    if not more:
                        return False
                    group |= more & -more
        return True

    @cached_property
    def _together(self) -> Together:
        return may_hold_together(self._start, self._every)

    @cached_property
    def _operators(self) -> list[GroundOperator]:
        """The operators whose preconditions may hold together."""
        return [one for one in self._every if self._may_apply(one.preconditions)]

    def _may_apply(self, preconditions: int) -> bool:
        return all(preconditions & ~self._together.get(one, 0) == 0 for one in bits(preconditions))
