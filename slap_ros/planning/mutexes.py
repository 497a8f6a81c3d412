# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which pairs of atoms may hold together, by h².

P. Haslum, H. Geffner: Admissible Heuristics for Optimal Planning, AIPS 2000.

A pair may hold if it does at the start, or if an operator whose preconditions may hold in pairs
adds both, or adds one and leaves the other. Pairs that are left out never hold together.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import and_

from slap_ros.planning.relaxation import bits
from slap_ros.relational import GroundOperator

Together = dict[int, int]  # by number of an atom: what may hold together with it, a mask


def may_hold_together(start: int, operators: Sequence[GroundOperator]) -> Together:
    """The atoms that may hold together with each atom that can be reached.

    Args:
        start: Abstract state to start from, a mask.
        operators: Ground operators over the same atom space.
    """
    together = dict.fromkeys(bits(start), start)
    prepared = [(one, bits(one.preconditions), bits(one.add_effects)) for one in operators]
    changed = True
    while changed:
        changed = False
        for operator, needed, added in prepared:
            beside = _beside(operator, needed, together)
            if beside is not None:
                kept = beside & ~operator.delete_effects | operator.add_effects
                for atom in added:
                    changed |= _join(atom, kept, together)
    return together


def never_together(goal: int, start: int, operators: Sequence[GroundOperator]) -> int:
    """The atoms of a goal of which two never hold together, or that never hold.

    Args:
        goal: Mask of atoms that must hold.
        start: Abstract state to start from, a mask.
        operators: Ground operators over the same atom space.

    Returns:
        A mask; 0 where each two may hold together, though maybe not all of them.
    """
    together = may_hold_together(start, operators)
    for atom in bits(goal):
        if missing := goal & ~together.get(atom, 0):
            return missing & -missing | 1 << atom
    return 0


def _beside(operator: GroundOperator, needed: Sequence[int], together: Together) -> int | None:
    """What may hold beside an operator's preconditions; None where these never hold together."""
    if any(atom not in together for atom in needed):
        return None
    if not needed:
        return reduce(lambda mask, atom: mask | 1 << atom, together, 0)
    beside = reduce(and_, (together[atom] for atom in needed))
    return beside if operator.preconditions & ~beside == 0 else None


def _join(atom: int, others: int, together: Together) -> bool:
    """Note that an atom may hold together with others; whether that is new."""
    known = together.get(atom, 0)
    fresh = (others | 1 << atom) & ~known
    if not fresh:
        return False
    together[atom] = known | fresh
    for other in bits(fresh):
        together[other] = together.get(other, 0) | 1 << atom | 1 << other
    return True
