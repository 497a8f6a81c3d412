# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The observations of a skill: the robot, the objects that it is applied to, and nothing else.

This is the state abstraction of LG-SAIL's Eq. 5. Every skill of every domain observes arrays of the
same size, so that a new skill can begin with the weights of any other: there are slots for the
operator's objects in the order of its parameters, and empty ones are zeros.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.errors import InvalidDomainError
from slap_ros.geometry.rotations import inverse_each, rotate_each, x_axes
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.portable_math import on_grid
from slap_ros.relational import Column
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import GroundedStates

SLOTS = 3  # slots for the objects of an operator, the robot itself not among them
ROBOT_FEATURES = 16  # features of the robot, at most
OBJECT_FEATURES = 16  # features of each object, at most
PAIRS = tuple(combinations(range(SLOTS), 2))
RELATION_FEATURES = 10  # features of each pair of objects
RELATIONS = ROBOT_FEATURES + SLOTS * (1 + OBJECT_FEATURES)  # index of the first relation feature
SIZE = RELATIONS + len(PAIRS) * RELATION_FEATURES
FINE = 0.2  # share of the interface's length below which a relative position is observed linearly


class SkillObserver:
    """Observations of grounded states, by a domain's learner's interface."""

    def __init__(self, domain: Domain) -> None:
        """Use a domain's features.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        self._interface, self._domain = learner_interface(domain), domain

    def __call__(self, states: GroundedStates) -> NDArray[np.float32]:
        """The observation in each state, shape (n, SIZE).

        Raises:
            InvalidDomainError: The operator has more objects than there are slots, or the domain
                more features.
        """
        state, interface = states.state, self._interface
        hand = interface.hand(state)
        observed = np.zeros((len(state.data), SIZE))
        self._put(observed, 0, interface.robot(state, hand), ROBOT_FEATURES)
        slots = self._slots(states)
        for slot, column in enumerate(slots):
            at = ROBOT_FEATURES + slot * (1 + OBJECT_FEATURES)
            observed[:, at] = 1.0
            features = states.pick(interface.objects(state, hand, column))
            self._put(observed, at + 1, features, OBJECT_FEATURES)
        for number, (one, other) in enumerate(PAIRS):
            if other < len(slots):
                at = RELATIONS + number * RELATION_FEATURES
                relation = self._relation(states, slots[one], slots[other])
                observed[:, at : at + relation.shape[-1]] = relation
        return on_grid(observed).astype(np.float32)

    def _slots(self, states: GroundedStates) -> list[Column]:
        slots = [
            column
            for column, kind in zip(states.columns, states.types, strict=True)
            if kind not in self._domain.robot_types
        ]
        if len(slots) > SLOTS:
            raise InvalidDomainError(
                f"domain {self._domain.name}: a skill is applied to {len(slots)} objects, "
                f"{SLOTS} are the most that can be observed"
            )
        return slots

    def _put(self, observed: Array, at: int, features: Array, most: int) -> None:
        if features.shape[-1] > most:
            raise InvalidDomainError(
                f"domain {self._domain.name}: its learner's interface has {features.shape[-1]} "
                f"features of the robot or of an object; {most} are the most"
            )
        observed[:, at : at + features.shape[-1]] = features

    def _relation(self, states: GroundedStates, one: Column, other: Column) -> Array:
        """The distance, direction and orientation of one object relative to the other.

        The direction is along the axes of the base, as actions are.

        How it is turned is told by its own x axis, and by the products of its coordinates, which
        are the same either way round, as many things may be.

        Args:
            states: Grounded states, of some groundings.
            one: First object of each grounding.
            other: Second object of each grounding.

        Returns:
            Shape (n, RELATION_FEATURES), or (n, 1) where the interface has no frames.
        """
        separation = self._separation(states, one, other)[:, None]
        if self._interface.frames is None:
            return separation
        (origin, turn), (base, frame) = (
            tuple(states.pick(part) for part in self._interface.frames(states.state, column))
            for column in (one, other)
        )
        fine = np.arcsinh((origin - base) / (FINE * self._interface.length_m))
        axis = rotate_each(inverse_each(frame), x_axes(turn))
        x, y, z = np.moveaxis(axis, -1, 0)
        either_way = np.stack([x * y, x * z, y * z], axis=-1)
        return np.concatenate([separation, fine, axis, either_way], axis=-1)

    def _separation(self, states: GroundedStates, one: Column, other: Column) -> Array:
        """Separation of the objects in two slots, from 0 to 1 at infinity, shape (n,)."""
        length = self._interface.length_m
        distances = np.empty(len(states.choice))
        for number, obj in enumerate(one.objects):
            mine = states.choice == number
            if mine.any():
                among = self._interface.separation(states.state, obj, other)
                distances[mine] = among[mine, number]
        separation: Array = distances / (distances + length)
        return separation
