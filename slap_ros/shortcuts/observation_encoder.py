# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut's policy observes, and whether the shortcut is done.

The observation has the robot and a slot for each role, filled with the object that plays it:
whether there is one, its features relative to the hand, and how much of its atoms is still to be
achieved (SLAP §4.4: the projection on relevant objects). Where a change concerns more objects of
a kind than training had, the slots hold those that are not done yet, in their order.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.portable_math import on_grid
from slap_ros.relational import AtomSpace, State, Target
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.shortcuts.changed_atoms import ACHIEVED, ChangedAtoms
from slap_ros.shortcuts.observation_layout import slot_groups
from slap_ros.shortcuts.shaping_potential import ShapingPotential
from slap_ros.shortcuts.shortcut_actions import make_action_map, uses_gripper
from slap_ros.shortcuts.signature import Change, Signature


class Encoding:
    """Observations, potential and outcome of each of n states; what is not asked for costs nothing.

    Attributes:
        achieved: Whether all changed atoms are achieved, past their thresholds by the success
            tolerance, and nothing moves, shape (n,).
        failure: Whether something happened that cannot be undone, shape (n,): the domain says
            so, or an object was released elsewhere than where it should be.
    """

    def __init__(self, encoder: ObservationEncoder, state: State) -> None:
        """Find out how the episodes stand.

        Args:
            encoder: Encoder for the change to be made.
            state: Batch of n states, whose data nobody changes as long as the encoding is asked.
        """
        self._encoder, self._state = encoder, state
        self._deficits = encoder.changed.deficits(state)
        holds = self._deficits < ACHIEVED
        self._at_rest = encoder.interface.at_rest(state)
        self._in_place: Bools = np.logical_and.reduce(holds, axis=-1)
        self.achieved: Bools = self._in_place & self._at_rest
        dropped = encoder.changed.released(holds) & self._at_rest & ~self.achieved
        self.failure: Bools = encoder.interface.failed(state) | dropped

    @cached_property
    def observations(self) -> NDArray[np.float32]:
        """Observations for the policy, of the same size for all changes that the signature matches.

        Returns:
            Shape (n, size).
        """
        return self._encoder.observe(self._state, self._hand, self._object_deficits)

    @cached_property
    def potential(self) -> Array:
        """The potential for shaping rewards, about minus the steps to go, shape (n,)."""
        return self._encoder.potential.of(
            self._state,
            self._deficits,
            self._object_deficits,
            self._distances,
            self._in_place & ~self._at_rest,
        )

    @cached_property
    def _hand(self) -> Array:
        return self._encoder.interface.hand(self._state)

    @cached_property
    def _distances(self) -> Array:
        return self._encoder.potential.distances(self._state, self._hand)

    @cached_property
    def _object_deficits(self) -> Array:
        return self._encoder.potential.object_deficits(self._state, self._hand, self._deficits)


class ObservationEncoder:
    """Encodes batches of states for one change in one task."""

    def __init__(
        self, domain: Domain, space: AtomSpace, signature: Signature, change: Change
    ) -> None:
        """Work out which atoms are about which objects.

        Args:
            domain: Domain whose learner's interface is used.
            space: Atoms of the task.
            signature: Signature of the shortcut, whose slots the observation has.
            change: Change of atoms that the shortcut makes in this task.

        Raises:
            InvalidDomainError: The domain has no learner's interface.
        """
        self.domain, self.space, self.signature, self.change = domain, space, signature, change
        self.interface = learner_interface(domain)
        self.changed = ChangedAtoms(domain, space, change)
        self._groups = slot_groups(signature, space, self.changed.objects)
        self.potential = ShapingPotential(self.interface, self.changed, self._groups)
        self.action_map = make_action_map(domain, signature)
        self.robot_columns = _robot_columns(domain, space)
        grasps = uses_gripper(domain, signature)
        self._kept_grasp = 0 if grasps else self.interface.grasp_atoms(space)

    def encode(self, state: State) -> Encoding:
        """Encode states, a batch of shape (n, layout.size)."""
        return Encoding(self, state)

    def success(self, state: State, encoding: Encoding, targets: Sequence[int]) -> Bools:
        """Whether each state is one in which the shortcut ends.

        Where options are not exact, more atoms may hold than those of the target, but none that
        the shortcut deletes.

        Args:
            state: Batch of n states.
            encoding: Encoding of these states.
            targets: Abstract state that each state shall reach, n masks.

        Returns:
            Shape (n,).
        """
        success = encoding.achieved.copy()
        rows = np.flatnonzero(success).tolist()
        for i, abstract in zip(rows, self._abstract_each(state, rows), strict=True):
            success[i] = self._target(targets[i]).reached(abstract)
        return success

    def _abstract_each(self, state: State, rows: Sequence[int]) -> Sequence[int]:
        """Abstract states of some of a batch of states, masks."""
        if len(rows) > 1:
            return self.space.abstract_each(State(state.layout, state.data[rows]))
        return [self.space.abstract(State(state.layout, state.data[i])) for i in rows]

    def _target(self, abstract: int) -> Target:
        """The target that stands for an abstract state, a mask."""
        if self.domain.exact:
            return Target.exactly(abstract)
        return Target(abstract, self.change.delete & ~abstract)

    def kept_grasp(self, state: State) -> int:
        """The atoms about what is held that must stay as they are, a mask.

        None of them of a shortcut that acts with the gripper. Any other cannot take again what
        fell out of the hand.
        """
        return self.space.abstract(state) & self._kept_grasp if self._kept_grasp else 0

    def accepts(self, state: State) -> bool:
        """Whether a shortcut may end in this state once its target's atoms hold."""
        return bool(self.encode(state.alone()).achieved[0])

    def observe(self, state: State, hand: Array, object_deficits: Array) -> NDArray[np.float32]:
        """What a policy observes, shape (n, size).

        Args:
            state: Batch of n states.
            hand: Hands in these states, as the learner's interface has them.
            object_deficits: Largest deficits of each object's atoms, shape (n, objects).
        """
        parts = [self.interface.robot(state, hand)]
        for slots, column, numbers in self._groups:
            features = self.interface.objects(state, hand, column)
            filled = _into_slots(features, object_deficits[:, numbers], slots)
            parts.append(filled.reshape(len(features), -1))
        return on_grid(np.concatenate(parts, axis=-1)).astype(np.float32)


def _robot_columns(domain: Domain, space: AtomSpace) -> NDArray[np.intp]:
    """The columns of a state that have the features of the robot itself."""
    layout = space.layout
    return np.array(
        [
            layout.column(obj, feature.name)
            for kind in sorted(domain.robot_types, key=str)
            for obj in layout.of_type(kind)
            for feature in kind.features
        ],
        dtype=np.intp,
    )


def _into_slots(features: Array, deficits: Array, slots: int) -> Array:
    """Put objects into slots: that there is one, its deficit and its features.

    Args:
        features: Features of the objects, shape (n, objects, f).
        deficits: Deficits of the objects, shape (n, objects).
        slots: Number of slots.

    Returns:
        Shape (n, slots, 2 + f). Empty slots are zeros. Of too many objects, those that are done
        are left out first.
    """
    rows, count, size = features.shape
    filled = np.zeros((rows, max(count, slots), 2 + size))
    filled[:, :count, 0] = 1.0
    filled[:, :count, 1] = deficits
    filled[:, :count, 2:] = features
    if count <= slots:
        return filled
    first = np.argsort(deficits <= ACHIEVED, axis=1, kind="stable")[:, :slots]
    return np.take_along_axis(filled, first[..., None], axis=1)
