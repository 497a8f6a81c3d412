# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a pair of PDDL texts describes: a domain and a problem that belong to no world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from slap_ros.relational.atom_space import AtomSpace
from slap_ros.relational.objects import Type
from slap_ros.relational.operators import LiftedOperator, static_predicates
from slap_ros.relational.predicates import GroundAtom, Predicate
from slap_ros.relational.state import Layout


@dataclass(frozen=True)
class PddlDomain:
    """The symbolic part of a domain.

    Types have no features and predicates no classifiers, for there are no states to look at.
    """

    name: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    operators: tuple[LiftedOperator, ...]

    @cached_property
    def static_predicates(self) -> frozenset[Predicate]:
        """The predicates that no operator changes."""
        return static_predicates(self.predicates, self.operators)


@dataclass(frozen=True)
class PddlProblem:
    """Objects, the atoms that hold at first, and those that shall hold in the end."""

    name: str
    objects: Layout
    init: frozenset[GroundAtom]
    goal: frozenset[GroundAtom]

    def atom_space(self, domain: PddlDomain) -> AtomSpace:
        """The ground atoms over the problem's objects; static ones are as they are at first."""
        return AtomSpace(
            domain.predicates, domain.static_predicates, self.objects, self.init.__contains__
        )

    def initial_mask(self, space: AtomSpace) -> int:
        """The abstract state to start from."""
        return space.mask(self.init)

    def goal_mask(self, space: AtomSpace) -> int:
        """The atoms that shall hold in the end."""
        return space.mask(self.goal)
