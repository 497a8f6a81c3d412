# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where an option ends: the atoms that must hold, and those that must not.

Given options and shortcuts change what they say and nothing else, so their target is one abstract
state. What is acquired is done once all that is expected holds, T(x, ω) ⊆ x', and nothing that its
operator deletes (LG-SAIL Alg. 1, Eq. 4): other atoms may appear.
"""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.operators import GroundOperator

ATOMS_SHOWN = 3  # of each kind, in a message


@dataclass(frozen=True)
class Target:
    """Masks of atoms.

    Args:
        required: Those that must hold.
        forbidden: Those that must not; a negative mask where that is all others.
    """

    required: int
    forbidden: int

    @classmethod
    def exactly(cls, abstract: int) -> Target:
        """One abstract state: no other atoms may hold."""
        return cls(abstract, ~abstract)

    @classmethod
    def after(cls, operator: GroundOperator, abstract: int) -> Target:
        """What is expected of an operator in an abstract state; other atoms may appear.

        Args:
            operator: Operator that is carried out.
            abstract: Abstract state in which the operator begins.
        """
        return cls(operator.apply(abstract), operator.delete_effects)

    @property
    def exact(self) -> bool:
        """Whether it is one abstract state."""
        return self.forbidden == ~self.required

    def reached(self, abstract: int) -> bool:
        """Whether all that is required holds, and nothing that is forbidden."""
        return self.difference(abstract) == 0

    def difference(self, abstract: int) -> int:
        """The atoms that are required and do not hold, and those that are forbidden and do."""
        return (self.required & ~abstract) | (self.forbidden & abstract)

    def projected(self, space: AtomSpace, onto: AtomSpace) -> Target:
        """The same with the atoms of another space, where those that it lacks must not hold.

        Args:
            space: Atom space of the target's masks.
            onto: Over more objects.
        """
        required = space.project(self.required, onto)
        if self.exact:
            return Target.exactly(required)
        return Target(required, space.project(self.forbidden, onto))

    def why_missed(self, start: int, abstract: int, space: AtomSpace) -> str:
        """How an abstract state misses it, as the end of a sentence.

        Args:
            start: The abstract state from which it was to be reached.
            abstract: The one that was reached instead.
            space: Atom space of the masks.

        Returns:
            The atoms, and whether what was to change did not, or something else did; empty where
            nothing is asked for.
        """
        missed = self.difference(abstract)
        if not self.required:
            return ""
        if not missed:
            return ", but not surely, or not at rest"
        parts = [
            f"{list_atoms(space, mask)} {word}"
            for mask, word in (
                (missed & self.required, "missing"),
                (missed & ~self.required, "too many"),
            )
            if mask
        ]
        effects = self.difference(start)
        kind = "effect not reached" if missed & effects else "something else disturbed"
        return f" with {' and '.join(parts)}: {kind}"


def list_atoms(space: AtomSpace, mask: int) -> str:
    """The atoms of a mask, the first few of them by name."""
    names = sorted(map(str, space.decode(mask)))
    rest = len(names) - ATOMS_SHOWN
    return ", ".join(names[:ATOMS_SHOWN]) + (f" and {rest} more" if rest > 0 else "")
