# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut's policy observes, and how far a state is from the shortcut's target.

The observation has the robot and a slot for each role, filled with the object that plays it:
whether there is one, its features relative to the hand, and how much of its atoms is still to be
achieved (SLAP §4.4: the projection on relevant objects). Where a change concerns more objects of
a kind than training had, the slots hold those that are not done yet, in their order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.portable_math import on_grid
from slap_ros.relational import AtomSpace, Column, GroundAtom, Object, State, Target
from slap_ros.relational.predicates import Bools, Predicate
from slap_ros.relational.state import Array
from slap_ros.shortcuts.signature import Change, Kind, Signature, concerned, kinds
from slap_ros.tiered_function import TieredFunction

# Terms of the potential, all against the hand being ``length_m`` away from its next object.
ATOM_WEIGHT = 3.0  # an atom that is not achieved at all
PENDING_OBJECT_WEIGHT = 3.0  # an object whose turn has not come
PROXIMITY_WEIGHT = 3.0  # the hand at the last object, which is in place but still moves
JOINT_LIMIT_WEIGHT = 3.0  # an axis at its limit: a policy that drives it there is stuck
ACHIEVED = 1e-9  # deficit below which an atom counts as achieved


def uses_gripper(domain: Domain, signature: Signature) -> bool:
    """Whether the gripper is among its actions: it changes what is held, at its end or before."""
    if signature.regrasps:
        return True
    grasping = {predicate.name for predicate in learner_interface(domain).grasping}
    return any(predicate in grasping for _, predicate, _ in signature.patterns)


def make_action_map(domain: Domain, signature: Signature) -> ActionMap:
    """The map from the policy's actions to the robot's."""
    return ActionMap(domain, uses_gripper(domain, signature))


@dataclass(frozen=True)
class ObservationLayout:
    """Which features an observation has: those of the robot, then those of each slot.

    Args:
        robot: Number of features of the robot.
        slots: Number of slots of each kind, kinds in order.
        widths: Number of features in a slot of each kind.
    """

    robot: int
    slots: Mapping[Kind, int]
    widths: Mapping[Kind, int]

    @property
    def size(self) -> int:
        """The number of all features."""
        return self.robot + sum(count * self.widths[kind] for kind, count in self.slots.items())


def observation_layout(
    domain: Domain, signature: Signature, state: State
) -> ObservationLayout | None:
    """Which features observations of a shortcut have.

    Args:
        domain: Domain whose learner's interface is used.
        signature: Signature of the shortcut.
        state: State of a task.

    Returns:
        The layout; None where the task lacks objects of one of the signature's kinds.
    """
    interface, kind = learner_interface(domain), kinds(domain.atom_space(state))
    examples = {name: obj for obj, name in kind.items()}
    if not set(signature.slots) <= set(examples):
        return None
    batch = state.alone()
    hand = interface.hand(batch)
    widths = {
        # whether there is one, its deficit, and its own features
        name: 2 + interface.objects(batch, hand, Column.of(examples[name])).shape[-1]
        for name in signature.slots
    }
    return ObservationLayout(interface.robot(batch, hand).shape[-1], signature.slots, widths)


@dataclass(frozen=True)
class _Atoms:
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


@dataclass(frozen=True, eq=False)
class _Orphans:
    """Changed atoms that are only about places, and what can be moved in their stead."""

    atoms: NDArray[np.intp]  # their numbers
    places: list[int]  # numbers of the objects that they are about
    movable: NDArray[np.intp]  # numbers of the objects that can be moved
    column: Column  # those objects


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
        self._deficits = encoder.deficits(state)
        holds = self._deficits < ACHIEVED
        self._at_rest = encoder.interface.at_rest(state)
        self._in_place: Bools = np.logical_and.reduce(holds, axis=-1)
        self.achieved: Bools = self._in_place & self._at_rest
        dropped = encoder.released(holds) & self._at_rest & ~self.achieved
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
        """The potential for shaping rewards, about minus the steps to go, shape (n,).

        Four terms: the deficits of the changed atoms, through the metric behind each predicate; the
        way to the lowest object with a deficit, as it carries the others; where everything is in
        place but still moves, how close the hand is; and the joint limit penalty.
        """
        encoder, moves = self._encoder, self._in_place & ~self._at_rest
        closeness = np.where(moves, encoder.closeness(self._distances), 0.0)
        potential: Array = (
            -encoder.effort(self._deficits, self._object_deficits, self._distances)
            - PROXIMITY_WEIGHT * closeness
            - JOINT_LIMIT_WEIGHT * encoder.interface.joint_limit_penalty(self._state)
        )
        return potential

    @cached_property
    def _hand(self) -> Array:
        return self._encoder.interface.hand(self._state)

    @cached_property
    def _distances(self) -> Array:
        return self._encoder.distances(self._state, self._hand)

    @cached_property
    def _object_deficits(self) -> Array:
        return self._encoder.object_deficits(self._state, self._hand, self._deficits)


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
        self.objects = concerned(change, space)
        self._number = {obj: i for i, obj in enumerate(self.objects)}
        self._atoms = [
            self._group(sign == "+", predicate, [atom for _, atom in atoms])
            for (sign, predicate), atoms in groupby(
                change.atoms(space), key=lambda signed: (signed[0], signed[1].predicate)
            )
        ]
        self._incidence, self._placing, self._releasing = self._classify_atoms()
        self._releases = bool(self._releasing.any())
        self._shares = self._incidence.astype(np.float64)
        self._orphans: _Orphans | None = None  # until there is a state to look at
        self._kinds = self._of_kinds()
        self.action_map = make_action_map(domain, signature)
        self.robot_columns = _robot_columns(domain, space)
        grasps = uses_gripper(domain, signature)
        self._kept_grasp = 0 if grasps else self.interface.grasp_atoms(space)

    def _group(self, wanted: bool, predicate: Predicate, atoms: Sequence[GroundAtom]) -> _Atoms:
        columns = tuple(Column(objs) for objs in zip(*(a.objects for a in atoms), strict=True))
        tolerance = np.array([self.interface.success_tolerance(atom) for atom in atoms])
        return _Atoms(predicate, wanted, columns, tolerance)

    def _classify_atoms(self) -> tuple[Bools, Bools, Bools]:
        """Which changed atoms are about which objects, about no grasp, about an empty hand.

        Returns:
            Shapes (atoms, objects), (atoms,) and (atoms,).
        """
        signed, grasping = list(self.change.atoms(self.space)), self.interface.grasping
        incidence = np.array([[obj in atom.objects for obj in self.objects] for _, atom in signed])
        placing = np.array([atom.predicate not in grasping for _, atom in signed])
        releasing = np.array(
            [
                sign == "+"
                and atom.predicate in grasping
                and all(obj.type in self.domain.robot_types for obj in atom.objects)
                for sign, atom in signed
            ]
        )
        return incidence, placing, releasing

    def _of_kinds(self) -> list[tuple[int, Column, NDArray[np.intp]]]:
        """The slots, the objects and their numbers, for each kind."""
        kind: dict[Kind, list[Object]] = {name: [] for name in self.signature.slots}
        for obj in self.objects:
            kind[kinds(self.space)[obj]].append(obj)
        return [
            (self.signature.slots[name], Column(tuple(objects)), self._numbers(objects))
            for name, objects in kind.items()
        ]

    def _numbers(self, objects: Sequence[Object]) -> NDArray[np.intp]:
        return np.array([self._number[obj] for obj in objects], dtype=np.intp)

    def encode(self, state: State) -> Encoding:
        """Encode states, a batch of shape (n, layout.size)."""
        return Encoding(self, state)

    def deficits(self, state: State) -> Array:
        """Deficits of the changed atoms, 0 where achieved, shape (n, atoms)."""
        length = self.interface.length_m
        return np.concatenate([group.deficits(state, length) for group in self._atoms], axis=-1)

    def released(self, holds: Bools) -> Bools:
        """Whether the shortcut has emptied the hand, shape (n,).

        Args:
            holds: Whether each changed atom is achieved, shape (n, atoms).
        """
        if not self._releases:
            return np.zeros(len(holds), dtype=bool)
        released: Bools = np.logical_or.reduce(holds[:, self._releasing], axis=-1)
        return released

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

    def distances(self, state: State, hand: Array) -> Array:
        """Distances to each object from the hand, m, shape (n, objects); infinite to a place."""
        distances = np.full((len(state.data), len(self.objects)), np.inf)
        for _, column, numbers in self._kinds:
            distances[:, numbers] = self.interface.distance(state, hand, column)
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
            separation = self.interface.separation(state, self.objects[i], orphans.column)
            nearest = orphans.movable[separation.argmin(axis=-1)]
            own[rows, nearest] = np.maximum(own[rows, nearest], due[:, i])
        return own

    def _find_orphans(self, state: State, hand: Array) -> _Orphans:
        """The orphans; which objects can be moved is the same in every state, so that one tells."""
        if self._orphans is None:
            first = State(state.layout, state.data[:1])
            movable = np.isfinite(self.distances(first, hand[:1])[0])
            alone = self._placing & ~(self._incidence & movable).any(axis=1)
            about = self._incidence[alone].any(axis=0) if movable.any() else movable
            choice = np.flatnonzero(movable)
            self._orphans = _Orphans(
                np.flatnonzero(alone),
                np.flatnonzero(about).tolist(),
                choice,
                Column(tuple(self.objects[i] for i in choice)),
            )
        return self._orphans

    def effort(self, deficits: Array, object_deficits: Array, distances: Array) -> Array:
        """What is still to be done, one object after the other, in order.

        Args:
            deficits: Deficits of the changed atoms, shape (n, atoms).
            object_deficits: Largest deficits of each object's atoms, shape (n, objects).
            distances: Distances of the objects from the hand, m, shape (n, objects).

        Returns:
            About the steps to go, shape (n,).
        """
        # The grasp comes last: a release counts for nothing before everything is in place.
        due = np.where(self._placing, deficits, 0.0).max(axis=-1, keepdims=True)
        deficits = np.where(self._placing, deficits, np.maximum(deficits, due))
        left = (object_deficits > ACHIEVED) & np.isfinite(distances)
        every, first = np.arange(len(left)), left.argmax(axis=-1)
        way = np.where(left.any(axis=-1), distances[every, first] / self.interface.length_m, 0.0)
        pending = PENDING_OBJECT_WEIGHT * np.maximum(left.sum(axis=-1) - 1, 0)
        effort: Array = ATOM_WEIGHT * deficits.sum(axis=-1) + way + pending
        return effort

    def closeness(self, distances: Array) -> Array:
        """How close the hand is to the nearest object, 0 to 1: what it touches does not rest."""
        nearest = distances.min(axis=-1, initial=np.inf)
        closeness: Array = np.maximum(1.0 - nearest / self.interface.length_m, 0.0)
        return closeness

    def observe(self, state: State, hand: Array, object_deficits: Array) -> NDArray[np.float32]:
        """What a policy observes, shape (n, size).

        Args:
            state: Batch of n states.
            hand: Hands in these states, as the learner's interface has them.
            object_deficits: See :meth:`object_deficits`.
        """
        parts = [self.interface.robot(state, hand)]
        for slots, column, numbers in self._kinds:
            features = self.interface.objects(state, hand, column)
            filled = _into_slots(features, object_deficits[:, numbers], slots)
            parts.append(filled.reshape(len(features), -1))
        return on_grid(np.concatenate(parts, axis=-1)).astype(np.float32)


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
