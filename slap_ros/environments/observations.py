# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner sees of a state: its features, or what shortcuts see.

Both are vectors of 32-bit floats of one length for all tasks; each object has its slot, which
begins with 1 where there is an object, and else is 0 throughout.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.environments.slots import ObjectSlots
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace, Column, State
from slap_ros.relational.state import Array
from slap_ros.shortcuts.signature import Kind

Vector = NDArray[np.float32]
Encode = Callable[[State, AtomSpace], Vector]  # a batch of n states, to shape (n, size)
LARGEST = 10.0  # magnitude of an observed feature
# In which each unit's features are of magnitude 1 or so; other units as they are.
SCALES: Mapping[str, float] = {"m": 0.25, "m/s": 0.5, "kg": 0.5}


def vector_space(size: int) -> spaces.Box:
    """The space of observations with so many features."""
    return spaces.Box(-LARGEST, LARGEST, (size,), np.float32)


class FeatureObservation:
    """All features of all objects, scaled, from the mean of the same kind in some tasks."""

    def __init__(self, slots: ObjectSlots, examples: Sequence[tuple[State, AtomSpace]]) -> None:
        """Measure the mean of each feature of each kind of object.

        Args:
            slots: Slots for the objects.
            examples: States with their atoms, which together fill every slot.
        """
        self._slots = slots
        seen: dict[Kind, list[Array]] = {name: [] for name in slots.counts}
        for state, space in examples:
            for name, _, column in slots.columns(space):
                seen[name] += list(self._features(state.alone(), name, column)[0])
        self._means = {name: np.mean(rows, axis=0) for name, rows in seen.items()}
        self.size = sum(
            count * (1 + len(slots.types[name].features)) for name, count in slots.counts.items()
        )

    def __call__(self, state: State, space: AtomSpace) -> Vector:
        """Encode a batch of n states; shape (n, size)."""
        parts = [
            in_slots(self._features(state, name, column) - self._means[name], count)
            for name, count, column in self._slots.columns(space)
        ]
        return limited(np.concatenate(parts, axis=-1))

    def _features(self, state: State, name: Kind, column: Column) -> Array:
        """Scaled features of objects of a kind, shape (n, objects, features)."""
        features = self._slots.types[name].features
        scales = np.array([SCALES.get(feature.unit, 1.0) for feature in features])
        if not column.objects or not features:
            return np.zeros((len(state.data), len(column.objects), len(features)))
        found: Array = np.stack([state.stack(column, f.name) for f in features], axis=-1) / scales
        return found


class ViewObservation:
    """What shortcuts see: the robot, and each object relative to the hand."""

    def __init__(self, domain: Domain, slots: ObjectSlots, space: AtomSpace, state: State) -> None:
        """Find out how many features there are.

        Args:
            domain: Domain whose learner's interface is used.
            slots: Slots for the objects.
            space: Atoms of a task that has an object of each kind.
            state: State of that task.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        self._interface = learner_interface(domain)
        kept = [name for name in slots.counts if slots.types[name] not in domain.robot_types]
        self._slots, self._kept = slots, frozenset(kept)
        self._widths: dict[Kind, int] = {}
        batch = state.alone()
        hand = self._interface.hand(batch)
        for name, _, column in slots.columns(space):
            if name in self._kept:
                self._widths[name] = self._interface.objects(batch, hand, column).shape[-1]
        self.size = self(batch, space).shape[-1]

    def __call__(self, state: State, space: AtomSpace) -> Vector:
        """Encode a batch of n states; shape (n, size)."""
        hand = self._interface.hand(state)
        parts = [self._interface.robot(state, hand)]
        for name, count, column in self._slots.columns(space):
            if name not in self._kept:
                continue
            features = np.zeros((len(state.data), 0, self._widths[name]))
            if column.objects:
                features = self._interface.objects(state, hand, column)
            parts.append(in_slots(features, count))
        return limited(np.concatenate(parts, axis=-1))


def in_slots(features: Array, count: int) -> Array:
    """Features of objects, shape (n, objects, f), in slots; shape (n, count * (1 + f))."""
    n, objects, width = features.shape
    slots = np.zeros((n, count, 1 + width))
    slots[:, :objects, 0] = 1.0
    slots[:, :objects, 1:] = features
    return slots.reshape(n, -1)


def limited(features: Array) -> Vector:
    """Features within the observation space, as 32-bit floats."""
    return np.clip(features, -LARGEST, LARGEST).astype(np.float32)


def truths(space: AtomSpace, abstract: int) -> Vector:
    """1 for each atom that holds, in the order of the space; shape (atoms,).

    Args:
        space: Atoms of the task.
        abstract: The atoms that hold, a mask.
    """
    return np.array([(abstract >> i) & 1 for i in range(len(space.atoms))], dtype=np.float32)
