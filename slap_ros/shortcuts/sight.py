# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a shortcut's policy sees, and how far it still has to go.

The observation has the robot and a slot for each role, of the object that plays it: whether there
is one, what it looks like from the robot, how much of its atoms is still to be done (SLAP §4.4:
the projection on relevant objects). Where a change concerns more objects of a kind than training
had, the slots show those that are not done yet, in their order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain, LearnerInterface
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import AtomSpace, Column, GroundAtom, Object, State
from slap_ros.relational.predicates import Bools, Predicate
from slap_ros.relational.state import Array
from slap_ros.shortcuts.action_map import ActionMap
from slap_ros.shortcuts.signature import Change, Kind, Signature, concerned, kinds

WEIGHT = 3.0  # of an atom that is not done at all against being ``length_m`` away
QUEUE = 3.0  # of an object whose turn has not come, against the same
HANDS_OFF = 3.0  # of being where the last object was put while it still moves, against the same
STRAIN = 3.0  # of an axis at its limit, against the same: a policy that drives it there is stuck
DONE = 1e-9  # deficit below which an atom counts as done


def learner_interface(domain: Domain) -> LearnerInterface:
    """What the domain tells learners.

    Raises:
        InvalidDomainError: Nothing: ``Domain.learning`` is None.
    """
    if domain.learning is None:
        raise InvalidDomainError(
            f"domain {domain.name} has no learner's interface, so that nothing can be learned in "
            "it; see Domain.learning"
        )
    return domain.learning.interface


def uses_gripper(domain: Domain, signature: Signature) -> bool:
    """Whether the shortcut is to change what is held, and so has the gripper among its actions."""
    grasping = {predicate.name for predicate in learner_interface(domain).grasping}
    return any(predicate in grasping for _, predicate, _ in signature.patterns)


def action_map(domain: Domain, signature: Signature) -> ActionMap:
    """What the policy's actions are."""
    return ActionMap(domain, uses_gripper(domain, signature))


def observation_size(domain: Domain, signature: Signature) -> int | None:
    """How much the policy sees; None where no task at hand has objects of all its kinds."""
    view, state = learner_interface(domain), domain.task(0).initial_state
    kind = kinds(domain.atom_space(state))
    examples = {name: obj for obj, name in kind.items()}
    if not set(signature.slots) <= set(examples):
        return None
    batch = state.alone()
    hand = view.hand(batch)
    size = view.robot(batch, hand).shape[-1]
    for name, slots in signature.slots.items():
        seen = view.objects(batch, hand, Column((examples[name],)))
        size += slots * (2 + seen.shape[-1])  # whether there is one, and what is missing
    return int(size)


@dataclass(frozen=True)
class _Atoms:
    """Changed atoms of one predicate and sign."""

    predicate: Predicate
    wanted: bool
    columns: tuple[Column, ...]
    slack: Array  # of each

    def deficits(self, state: State, length: float) -> Array:
        """0 where done, towards 1 the further away, shape (n, atoms)."""
        if self.predicate.margin is None:
            holds = self.predicate.classifier(state, *self.columns)
            return np.where(holds == self.wanted, 0.0, 1.0)
        margin = self.predicate.margin(state, *self.columns)
        missing = np.maximum(self.slack + (-margin if self.wanted else margin), 0.0)
        deficits: Array = missing / (missing + length)
        return deficits


@dataclass(frozen=True)
class Look:
    """What there is to see in each of n states.

    Args:
        observations: For the policy, shape (n, size); of the same size for all changes that the
            signature suits.
        potential: About minus the steps to go, shape (n,), for shaping rewards. Four terms: what
            is missing of the changed atoms, through the metric behind each predicate; the way to
            the lowest object of which something is missing: it carries the rest; where nothing is
            missing but rest, how close the hand still is; and the robot's strain.
        near: Whether nothing is missing, slack included, and nothing moves, shape (n,).
        lost: Whether something happened that cannot be undone, shape (n,): the domain says what,
            and what was let go of somewhere else than it should be is out of hand.
    """

    observations: NDArray[np.float32]
    potential: Array
    near: Bools
    lost: Bools


class Sight:
    """The senses of one change in one task, for batches of states."""

    def __init__(
        self, domain: Domain, space: AtomSpace, signature: Signature, change: Change
    ) -> None:
        self.domain, self.space, self.signature, self.change = domain, space, signature, change
        self.view = learner_interface(domain)
        self.objects = concerned(change, space)
        self._number = {obj: i for i, obj in enumerate(self.objects)}
        self._atoms = [
            self._group(sign == "+", predicate, [atom for _, atom in atoms])
            for (sign, predicate), atoms in groupby(
                change.atoms(space), key=lambda signed: (signed[0], signed[1].predicate)
            )
        ]
        self._about = np.array(  # (atoms, objects): which atoms are about which objects
            [[obj in atom.objects for obj in self.objects] for _, atom in change.atoms(space)]
        )
        self._about_places = np.array(
            [atom.predicate not in self.view.grasping for _, atom in change.atoms(space)]
        )
        self._empties = np.array(  # which atoms say that the hand is empty
            [
                sign == "+"
                and atom.predicate in self.view.grasping
                and all(obj.type in domain.robot_types for obj in atom.objects)
                for sign, atom in change.atoms(space)
            ]
        )
        self._kinds = self._of_kinds()
        self.actions = action_map(domain, signature)
        layout = space.layout
        self.robot_features = np.array(  # where a state has the robot's own
            [
                layout.column(obj, feature.name)
                for kind in sorted(domain.robot_types, key=str)
                for obj in layout.of_type(kind)
                for feature in kind.features
            ],
            dtype=np.intp,
        )

    def _group(self, wanted: bool, predicate: Predicate, atoms: Sequence[GroundAtom]) -> _Atoms:
        columns = tuple(Column(objs) for objs in zip(*(a.objects for a in atoms), strict=True))
        slack = np.array([self.view.success_tolerance(atom) for atom in atoms])
        return _Atoms(predicate, wanted, columns, slack)

    def _of_kinds(self) -> list[tuple[int, Column, NDArray[np.intp]]]:
        """For each kind: slots, objects, and their numbers."""
        kind: dict[Kind, list[Object]] = {name: [] for name in self.signature.slots}
        for obj in self.objects:
            kind[kinds(self.space)[obj]].append(obj)
        return [
            (self.signature.slots[name], Column(tuple(objects)), self._numbers(objects))
            for name, objects in kind.items()
        ]

    def _numbers(self, objects: Sequence[Object]) -> NDArray[np.intp]:
        return np.array([self._number[obj] for obj in objects], dtype=np.intp)

    def look(self, state: State) -> Look:
        """Look at states, a batch of shape (n, layout.size)."""
        length = self.view.length_m
        deficits = np.concatenate([g.deficits(state, length) for g in self._atoms], axis=-1)
        hand = self.view.hand(state)
        ways = self._ways(state, hand)
        missing = self._missing(state, deficits, ways)
        done, settled = deficits < DONE, self.view.at_rest(state)
        put = done.all(axis=-1)
        near = put & settled
        dropped = done[:, self._empties].any(axis=-1) & settled & ~near
        return Look(
            self._observe(state, hand, missing),
            self._potential(deficits, missing, ways)
            - HANDS_OFF * np.where(put & ~settled, self._closeness(ways), 0.0)
            - STRAIN * self.view.joint_limit_penalty(state),
            near,
            self.view.failed(state) | dropped,
        )

    def done(self, state: State, look: Look, targets: Sequence[int]) -> Bools:
        """Whether each state is one in which the shortcut may end, in its abstract state."""
        done = look.near.copy()
        for i in np.flatnonzero(done):
            done[i] = self.space.abstract(State(state.layout, state.data[i])) == targets[int(i)]
        return done

    def may_end(self, state: State) -> bool:
        """Whether a shortcut may end in this state once its target's atoms hold."""
        return bool(self.look(state.alone()).near[0])

    def _ways(self, state: State, hand: Array) -> Array:
        """From the hand to each object, m; infinite to what it cannot go to."""
        ways = np.full((len(state.data), len(self.objects)), np.inf)
        for _, column, numbers in self._kinds:
            ways[:, numbers] = self.view.distance(state, hand, column)
        return ways

    def _missing(self, state: State, deficits: Array, ways: Array) -> Array:
        """What is missing of each object's atoms, shape (n, objects).

        Of atoms that are about nothing one could go to, the nearest object is to blame that one
        can: a block in the wrong place is what is to be moved, not the place.
        """
        missing: Array = (deficits[:, :, None] * self._about).max(axis=1)
        can_go = np.isfinite(ways[0])
        orphans = self._about_places & ~(self._about & can_go).any(axis=1)
        if not orphans.any() or not can_go.any():
            return missing
        choice = np.flatnonzero(can_go)
        column = Column(tuple(self.objects[i] for i in choice))
        due = (deficits[:, orphans, None] * self._about[orphans]).max(axis=1)
        rows = np.arange(len(missing))
        for i in np.flatnonzero(self._about[orphans].any(axis=0)):
            nearest = choice[self.view.separation(state, self.objects[i], column).argmin(axis=-1)]
            missing[rows, nearest] = np.maximum(missing[rows, nearest], due[:, i])
        return missing

    def _potential(self, deficits: Array, missing: Array, ways: Array) -> Array:
        """Objects one after the other, in their order; each that is done is a step forward."""
        # The grasp comes last: to let go counts for nothing before all is in its place.
        due = np.where(self._about_places, deficits, 0.0).max(axis=-1, keepdims=True)
        deficits = np.where(self._about_places, deficits, np.maximum(deficits, due))
        left = (missing > DONE) & np.isfinite(ways)
        every, first = np.arange(len(left)), left.argmax(axis=-1)
        way = np.where(left.any(axis=-1), ways[every, first] / self.view.length_m, 0.0)
        queue = QUEUE * np.maximum(left.sum(axis=-1) - 1, 0)
        potential: Array = -(WEIGHT * deficits.sum(axis=-1) + way + queue)
        return potential

    def _closeness(self, ways: Array) -> Array:
        """How close the hand is to the nearest object, 0 to 1: what it presses on does not rest."""
        nearest = ways.min(axis=-1, initial=np.inf)
        closeness: Array = np.maximum(1.0 - nearest / self.view.length_m, 0.0)
        return closeness

    def _observe(self, state: State, hand: Array, missing: Array) -> NDArray[np.float32]:
        parts = [self.view.robot(state, hand)]
        for slots, column, numbers in self._kinds:
            seen = self.view.objects(state, hand, column)
            there = np.ones((*seen.shape[:2], 1))
            seen = np.concatenate([there, missing[:, numbers, None], seen], axis=-1)
            parts.append(_into_slots(seen, slots).reshape(len(seen), -1))
        return np.concatenate(parts, axis=-1).astype(np.float32)


def _into_slots(seen: Array, slots: int) -> Array:
    """Shape (n, objects, f) into (n, slots, f): absent ones 0, of too many those not done."""
    count = seen.shape[1]
    if count <= slots:
        return np.pad(seen, ((0, 0), (0, slots - count), (0, 0)))
    done = seen[..., 1] <= DONE
    first = np.argsort(done, axis=1, kind="stable")[:, :slots]
    return np.take_along_axis(seen, first[..., None], axis=1)
