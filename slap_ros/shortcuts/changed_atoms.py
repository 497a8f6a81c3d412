# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The atoms that a shortcut changes, and how far each is from being changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from slap_ros.core import Domain, LearnerInterface
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace, Column, GroundAtom, Predicate, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.signature import Change, concerned

ACHIEVED = 1e-9  # deficit below which an atom counts as achieved


@dataclass(frozen=True)
class AtomGroup:
    """Changed atoms of one predicate and sign."""

    predicate: Predicate
    wanted: bool
    columns: tuple[Column, ...]
    tolerance: Array  # success tolerance of each atom, shape (atoms,)

    def deficits(self, state: State, length: float) -> Array:
        """Deficits of the atoms, 0 where achieved, towards 1 the further away, shape (n, atoms)."""
        if self.predicate.margin is None:
            holds = self.predicate.classifier(state, *self.columns)
            return np.where(holds == self.wanted, 0.0, 1.0)
        margin = self.predicate.margin(state, *self.columns)
        missing = np.maximum(self.tolerance + (-margin if self.wanted else margin), 0.0)
        deficits: Array = missing / (missing + length)
        return deficits


class ChangedAtoms:
    """The atoms of one change in one task."""

    def __init__(self, domain: Domain, space: AtomSpace, change: Change) -> None:
        """Work out which atoms are about which objects.

        Args:
            domain: Domain whose learner's interface is used.
            space: Atoms of the task.
            change: Change of atoms that the shortcut makes in this task.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        interface = learner_interface(domain)
        self.objects = concerned(change, space)
        self._length_m = interface.length_m
        self._groups = [
            _group(interface, sign == "+", predicate, [atom for _, atom in atoms])
            for (sign, predicate), atoms in groupby(
                change.atoms(space), key=lambda signed: (signed[0], signed[1].predicate)
            )
        ]
        signed, grasping = list(change.atoms(space)), interface.grasping
        # Which atoms are about which objects, shape (atoms, objects).
        self.incidence: Bools = np.array(
            [[obj in atom.objects for obj in self.objects] for _, atom in signed]
        )
        # Which atoms are about no grasp, shape (atoms,).
        self.placing: Bools = np.array([atom.predicate not in grasping for _, atom in signed])
        self._releasing: Bools = np.array(  # which say that the hand is empty, shape (atoms,)
            [
                sign == "+"
                and atom.predicate in grasping
                and all(obj.type in domain.robot_types for obj in atom.objects)
                for sign, atom in signed
            ]
        )
        self._releases = bool(self._releasing.any())

    def deficits(self, state: State) -> Array:
        """Deficits of the changed atoms, 0 where achieved, shape (n, atoms)."""
        return np.concatenate(
            [group.deficits(state, self._length_m) for group in self._groups], axis=-1
        )

    def released(self, holds: Bools) -> Bools:
        """Whether the shortcut has emptied the hand, shape (n,).

        Args:
            holds: Whether each changed atom is achieved, shape (n, atoms).
        """
        if not self._releases:
            return np.zeros(len(holds), dtype=bool)
        released: Bools = np.logical_or.reduce(holds[:, self._releasing], axis=-1)
        return released


def _group(
    interface: LearnerInterface, wanted: bool, predicate: Predicate, atoms: Sequence[GroundAtom]
) -> AtomGroup:
    columns = tuple(Column(objs) for objs in zip(*(a.objects for a in atoms), strict=True))
    tolerance = np.array([interface.success_tolerance(atom) for atom in atoms])
    return AtomGroup(predicate, wanted, columns, tolerance)
