# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far a state is from the target of a shortcut: a potential for shaping rewards.

Potential-based shaping (Ng et al. 1999) leaves the best policy as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import LearnerInterface
from slap_ros.relational import Column, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.changed_atoms import ACHIEVED, ChangedAtoms
from slap_ros.shortcuts.observation_layout import SlotGroup
from slap_ros.tiered_function import TieredFunction

# Terms of the potential, all against the hand being ``length_m`` away from its next object.
ATOM_WEIGHT = 3.0  # an atom that is not achieved at all
PENDING_OBJECT_WEIGHT = 3.0  # an object whose turn has not come
PROXIMITY_WEIGHT = 3.0  # the hand at the last object, which is in place but still moves
JOINT_LIMIT_WEIGHT = 3.0  # an axis at its limit: a policy that drives it there is stuck


@dataclass(frozen=True, eq=False)
class _Orphans:
    """Changed atoms that are only about places, and what can be moved in their stead."""

    atoms: NDArray[np.intp]  # their numbers
    places: list[int]  # numbers of the objects that they are about
    movable: NDArray[np.intp]  # numbers of the objects that can be moved
    column: Column  # those objects


class ShapingPotential:
    """Measures what is still to be done of one change in one task."""

    def __init__(
        self, interface: LearnerInterface, changed: ChangedAtoms, groups: Sequence[SlotGroup]
    ) -> None:
        """Look at no state yet.

        Args:
            interface: Learner's interface of the domain.
            changed: Atoms that the shortcut changes.
            groups: Objects that the shortcut is about, by kind.
        """
        self._interface, self._changed, self._groups = interface, changed, groups
        self._shares = changed.incidence.astype(np.float64)
        self._orphans: _Orphans | None = None  # until there is a state to look at

    def of(
        self,
        state: State,
        deficits: Array,
        object_deficits: Array,
        distances: Array,
        moves_in_place: Bools,
    ) -> Array:
        """The potential, about minus the steps to go, shape (n,).

        Four terms: the deficits of the changed atoms, through the metric behind each predicate; the
        way to the lowest object with a deficit, as it carries the others; where everything is in
        place but still moves, how close the hand is; and the joint limit penalty.

        Args:
            state: Batch of n states.
            deficits: Deficits of the changed atoms, shape (n, atoms).
            object_deficits: See :meth:`object_deficits`.
            distances: See :meth:`distances`.
            moves_in_place: Whether everything is in place but still moves, shape (n,).
        """
        closeness = np.where(moves_in_place, self._closeness(distances), 0.0)
        potential: Array = (
            -self._effort(deficits, object_deficits, distances)
            - PROXIMITY_WEIGHT * closeness
            - JOINT_LIMIT_WEIGHT * self._interface.joint_limit_penalty(state)
        )
        return potential

    def distances(self, state: State, hand: Array) -> Array:
        """Distances to each object from the hand, m, shape (n, objects); infinite to a place."""
        distances = np.full((len(state.data), len(self._changed.objects)), np.inf)
        for _, column, numbers in self._groups:
            distances[:, numbers] = self._interface.distance(state, hand, column)
        return distances

    def object_deficits(self, state: State, hand: Array, deficits: Array) -> Array:
        """The largest deficit among each object's atoms.

        The deficit of an atom that is only about places counts for the nearest object that can be
        moved: a block in the wrong place is what is to be moved, not the place.

        Args:
            state: Batch of n states.
            hand: Hands in these states, as the learner's interface has them.
            deficits: Deficits of the changed atoms, shape (n, atoms).

        Returns:
            Shape (n, objects).
        """
        largest = LARGEST_SHARES.of(len(deficits))
        own = largest(deficits, self._shares)
        orphans = self._find_orphans(state, hand)
        if not orphans.places:
            return own
        due = largest(deficits[:, orphans.atoms], self._shares[orphans.atoms])
        rows = np.arange(len(own))
        for i in orphans.places:
            separation = self._interface.separation(state, self._changed.objects[i], orphans.column)
            nearest = orphans.movable[separation.argmin(axis=-1)]
            own[rows, nearest] = np.maximum(own[rows, nearest], due[:, i])
        return own

    def _find_orphans(self, state: State, hand: Array) -> _Orphans:
        """The orphans; which objects can be moved is the same in every state, so that one tells."""
        if self._orphans is None:
            first = State(state.layout, state.data[:1])
            movable = np.isfinite(self.distances(first, hand[:1])[0])
            alone = self._changed.placing & ~(self._changed.incidence & movable).any(axis=1)
            about = self._changed.incidence[alone].any(axis=0) if movable.any() else movable
            choice = np.flatnonzero(movable)
            self._orphans = _Orphans(
                np.flatnonzero(alone),
                np.flatnonzero(about).tolist(),
                choice,
                Column(tuple(self._changed.objects[i] for i in choice)),
            )
        return self._orphans

    def _effort(self, deficits: Array, object_deficits: Array, distances: Array) -> Array:
        """What is still to be done, one object after the other, in order.

        Args:
            deficits: Deficits of the changed atoms, shape (n, atoms).
            object_deficits: Largest deficits of each object's atoms, shape (n, objects).
            distances: Distances of the objects from the hand, m, shape (n, objects).

        Returns:
            About the steps to go, shape (n,).
        """
        # The grasp comes last: a release counts for nothing before everything is in place.
        due = np.where(self._changed.placing, deficits, 0.0).max(axis=-1, keepdims=True)
        deficits = np.where(self._changed.placing, deficits, np.maximum(deficits, due))
        left = (object_deficits > ACHIEVED) & np.isfinite(distances)
        every, first = np.arange(len(left)), left.argmax(axis=-1)
        way = np.where(left.any(axis=-1), distances[every, first] / self._interface.length_m, 0.0)
        pending = PENDING_OBJECT_WEIGHT * np.maximum(left.sum(axis=-1) - 1, 0)
        effort: Array = ATOM_WEIGHT * deficits.sum(axis=-1) + way + pending
        return effort

    def _closeness(self, distances: Array) -> Array:
        """How close the hand is to the nearest object, 0 to 1: what it touches does not rest."""
        nearest = distances.min(axis=-1, initial=np.inf)
        closeness: Array = np.maximum(1.0 - nearest / self._interface.length_m, 0.0)
        return closeness


def largest_shares(deficits: Array, shares: Array) -> Array:
    """The largest deficit of each object.

    Args:
        deficits: Deficits of atoms, shape (n, atoms).
        shares: 1 where an atom is about an object, else 0, shape (atoms, objects).

    Returns:
        Shape (n, objects).
    """
    # Atoms first: the largest along the first axis is found several times as fast.
    largest: Array = np.maximum.reduce(deficits.T[:, :, None] * shares[:, None, :], axis=0)
    return largest


def _compiled_shares() -> Callable[[Array, Array], Array]:
    from slap_ros.shortcuts import kernels

    return lambda deficits, shares: kernels.largest_shares(np.ascontiguousarray(deficits), shares)


LARGEST_SHARES: TieredFunction[Callable[[Array, Array], Array]] = TieredFunction(
    largest_shares, _compiled_shares
)
