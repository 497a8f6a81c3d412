# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Goals by name, of objects by name."""

from __future__ import annotations

from slap_ros.core import Goal
from slap_ros.relational import GroundAtom, Predicate, State

NamedAtom = tuple[Predicate, *tuple[str, ...]]  # a predicate and the names of its objects


def goal(*atoms: NamedAtom) -> Goal:
    """The goal that all of these atoms hold: ``goal((ON, "cube1", "cube0"))``.

    It raises an UnknownObjectError of states that lack one of the objects.
    """

    def of_state(state: State) -> frozenset[GroundAtom]:
        return frozenset(predicate(*map(state.layout.object, names)) for predicate, *names in atoms)

    return of_state
