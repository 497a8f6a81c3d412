# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lower bound that counts what operators take from each other, as LM-cut alone does not.

Where operators delete nothing, a hand that is empty once stays so: of picks and places, only the
picks count. So the cost of what makes an atom true again (an empty hand, by a place) is moved to
what deletes it (a pick): a potential is the cost still owed while the atom does not hold, and each
operator costs what it changes of the potential besides its own steps. Along a plan these changes
sum up to what is owed at the end less what is owed at the start, so the bound of the new costs is,
up to that difference, one of the old. See F. Pommerening, M. Helmert, G. Röger, J. Seipp: From
Non-Negative to General Operator Cost Partitioning, AAAI 2015.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from slap_ros.planning.landmark_cut import LandmarkCut, RelaxedOperator
from slap_ros.planning.mutexes import may_hold_together
from slap_ros.planning.relaxation import bits
from slap_ros.relational import GroundOperator


class LeastSteps:
    """Environment steps to a goal at least: by landmarks, and by landmarks with a potential."""

    def __init__(self, goal: int, operators: Sequence[RelaxedOperator]) -> None:
        """Choose the atom of the potential: the one that most operators need and delete.

        Args:
            goal: Mask of atoms that must hold.
            operators: Relaxed operators, each of which costs something.
        """
        self._goal, self._atom = goal, contested(operators)
        self._weight = min((o.least_steps for o in operators if self._may_add(o)), default=0)
        self._shifted = LandmarkCut(goal, [self._shift(one) for one in operators])
        # The last operator of a shortest plan adds an atom of the goal.
        last = [one for one in operators if one.add_effects & goal]
        self._owed_at_end = 0 if all(map(self._leaves, last)) else self._weight
        self._plain = LandmarkCut(goal, operators) if self._owed_at_end else None

    def __call__(self, abstract: int) -> int | None:
        """Environment steps to the goal at least; None where it is out of reach.

        Args:
            abstract: Abstract state to start from, a mask.
        """
        if abstract & self._goal == self._goal:
            return 0
        shifted = self._shifted(abstract)
        if shifted is None:
            return None
        owed = 0 if abstract & self._atom else self._weight
        plain = self._plain(abstract) if self._plain is not None else None
        return max(plain or 0, shifted + owed - self._owed_at_end)

    def _may_add(self, operator: RelaxedOperator) -> bool:
        return bool(operator.add_effects & self._atom)

    def _shift(self, operator: RelaxedOperator) -> RelaxedOperator:
        """The operator with the least that it costs together with the change of the potential."""
        if self._may_add(operator):
            return replace(operator, least_steps=operator.least_steps - self._weight)
        if _takes(operator) & self._atom:
            return replace(operator, least_steps=operator.least_steps + self._weight)
        return operator

    def _leaves(self, operator: RelaxedOperator) -> bool:
        """Whether the atom holds after an operator for certain."""
        if operator.deletes is None:
            return False
        left = operator.preconditions & ~operator.deletes
        return bool((operator.add_effects | left) & self._atom)


def _takes(operator: RelaxedOperator) -> int:
    """The atoms that hold before an operator and do not after it, a mask."""
    return operator.preconditions & (operator.deletes or 0) & ~operator.add_effects


def contested(operators: Sequence[RelaxedOperator]) -> int:
    """The atom that most operators need and delete, the first of several, as a mask; 0: none."""
    taken = Counter(bit for one in operators for bit in bits(_takes(one)))
    return 1 << min(taken, key=lambda bit: (-taken[bit], bit)) if taken else 0


def alternate(operators: Sequence[GroundOperator], start: int) -> bool:
    """Whether each operator changes whether the atom holds that most of them need and delete.

    Args:
        operators: Ground operators over one atom space.
        start: Abstract state from which they are applied, a mask.
    """
    relaxed = [
        RelaxedOperator(one.preconditions, one.add_effects, 1, one.delete_effects)
        for one in operators
    ]
    atom = contested(relaxed)
    together = may_hold_together(start, operators)

    def switches(one: RelaxedOperator) -> bool:
        if _takes(one) & atom:
            return True
        needed = bits(one.preconditions)
        needs_it_not = any(not together.get(bit, 0) & atom for bit in needed)
        return bool(one.add_effects & atom) and needs_it_not

    return all(map(switches, relaxed))
