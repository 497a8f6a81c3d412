# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A PDDL task without variables: masks of atoms, and ground actions that change them.

Only atoms that some condition is about have a bit. Where a condition says that an atom must *not*
hold, the bit above the atom's is its complement, so that every condition is a mask of bits that are
set. A disjunction has a bit as well, which is set where one of its alternatives holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GroundEffect:
    """What becomes true and false where a condition holds; masks of atoms.

    Complements are left out: :meth:`GroundTask.apply` sets them.
    """

    condition: int
    added: int
    deleted: int


@dataclass(frozen=True, slots=True)
class GroundAction:
    """An operator applied to objects.

    Args:
        name: Name with its objects, as plans list it: ``(drive truck depot shop)``.
        precondition: Mask of bits that must be set.
        effects: Effects, all of which are judged in the state before the action.
        cost: Cost, at least 0.
    """

    name: str
    precondition: int
    effects: tuple[GroundEffect, ...]
    cost: float = 1


@dataclass(frozen=True, slots=True)
class Disjunction:
    """A bit that is set where all bits of one of the alternatives are."""

    bit: int
    alternatives: tuple[int, ...]


@dataclass(frozen=True)
class GroundTask:
    """Everything that a search needs to know.

    Args:
        size: Number of bits.
        start: State to start from.
        goal: Mask of bits that must be set in the end.
        actions: Ground actions, in the order of the domain's operators.
        complemented: Mask of the atoms whose complement has the next bit.
        disjunctions: Disjunctions, those first that others are made of.
        without_cost: Names of ground actions that are left out, as the problem does not give what
            they cost.
    """

    size: int
    start: int
    goal: int
    actions: tuple[GroundAction, ...]
    complemented: int = 0
    disjunctions: tuple[Disjunction, ...] = ()
    without_cost: tuple[str, ...] = ()

    def apply(self, action: GroundAction, state: int) -> int:
        """The state after an action that is applicable: deletes first, then adds."""
        added = deleted = 0
        for effect in action.effects:
            if state & effect.condition == effect.condition:
                added |= effect.added
                deleted |= effect.deleted
        return self.changed(state, added, deleted & ~added)

    def changed(self, state: int, added: int, deleted: int) -> int:
        """A state after some atoms, and others, were added and deleted.

        Args:
            state: State before.
            added: Mask of atoms that hold afterwards.
            deleted: Mask of other atoms, which do not.
        """
        if self.complemented:
            turned_off = (added & self.complemented) << 1
            turned_on = (deleted & self.complemented) << 1
            state = (state & ~(deleted | turned_off)) | added | turned_on
        else:
            state = (state & ~deleted) | added
        return with_disjunctions(state, self.disjunctions) if self.disjunctions else state


def with_disjunctions(state: int, disjunctions: Sequence[Disjunction]) -> int:
    """A state with the bits of disjunctions set as its atoms say."""
    for disjunction in disjunctions:
        if any(state & mask == mask for mask in disjunction.alternatives):
            state |= disjunction.bit
        else:
            state &= ~disjunction.bit
    return state
