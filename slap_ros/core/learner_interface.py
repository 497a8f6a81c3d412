# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a learner needs from a domain, as functions of many states at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from slap_ros.core.action_space import ActionSpace
from slap_ros.core.world import MakeVectorWorld
from slap_ros.relational import AtomSpace, Column, GroundAtom, Object, Predicate, State
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array


def _never(state: State) -> Bools:
    return np.zeros(state.data.shape[:-1], dtype=bool)


def no_penalty(state: State) -> Array:
    """No joint is near its limit, shape (n,)."""
    return np.zeros(state.data.shape[:-1])


def _always(state: State) -> Bools:
    return np.ones(state.data.shape[:-1], dtype=bool)


def exactly(_: GroundAtom) -> float:
    """No margin needs to be past its threshold."""
    return 0.0


@dataclass(frozen=True)
class LearnerInterface:
    """What learners observe, as functions of a batch of n states.

    Features are of magnitude 1 or so.

    Args:
        hand: (state) to where the robot acts from, in whatever form ``robot``, ``objects`` and
            ``distance`` take it; computed once for each batch.
        robot: (state, hand) to the robot's features, shape (n, k).
        objects: (state, hand, objects of one kind) to their features relative to the hand, shape
            (n, objects, f).
        distance: (state, hand, objects) to the distance of the hand, or of what it holds, from
            each, m, shape (n, objects); infinite for what there is no point in going to.
        separation: (state, object, objects) to the distance of each from the first, m, shape
            (n, objects).
        at_rest: (state) to whether nothing would move by itself any more, shape (n,).
        failed: (state) to whether something happened that cannot be undone, shape (n,).
        joint_limit_penalty: (state) to how close the robot is to its joint limits, shape (n,): 1
            for each axis at its limit, 0 well before.
        success_tolerance: (ground atom) to how far its margin must be past its threshold before
            a shortcut counts as done, in the margin's unit: room for the gripper beside what a
            shortcut moved, for instance.
        can_leave: (state) to whether the hand can go away from where it is, shape (n,): a learned
            skill ends where it can.
        grasping: Predicates about what is held. Only shortcuts that change one of their atoms
            have the gripper among their actions.
        length_m: Scale of distances and margins, m.
        frames: (state, objects) to where what is done with them happens, and how it is turned
            there: positions, m, shape (n, objects, 3), and quaternions (x, y, z, w), shape (n,
            objects, 4). None: of two objects, skills observe the distance alone.
    """

    hand: Callable[[State], Array]
    robot: Callable[[State, Array], Array]
    objects: Callable[[State, Array, Column], Array]
    distance: Callable[[State, Array, Column], Array]
    separation: Callable[[State, Object, Column], Array]
    at_rest: Callable[[State], Bools] = _always
    failed: Callable[[State], Bools] = _never
    joint_limit_penalty: Callable[[State], Array] = no_penalty
    success_tolerance: Callable[[GroundAtom], float] = exactly
    can_leave: Callable[[State], Bools] = _always
    grasping: frozenset[Predicate] = frozenset()
    length_m: float = 0.1
    frames: Callable[[State, Column], tuple[Array, Array]] | None = None

    def grasp_atoms(self, space: AtomSpace) -> int:
        """The ground atoms of a task about what is held, a mask."""
        return space.mask(atom for atom in space.atoms if atom.predicate in self.grasping)


SettingValue = bool | int | float | tuple[int, ...] | None  # None: a part that is left out


@dataclass(frozen=True)
class Learning:
    """What a domain offers to those who learn in it.

    Args:
        interface: Observations and distances; see :class:`LearnerInterface`.
        actions: Actions of a learned policy, where it may command less than the action space.
        make_vector_world: Function that makes worlds that are stepped together, where that is
            faster than one after the other.
        settings: Training settings of this domain where they differ from the usual ones: by the
            name of ``slap train --settings`` (``ours``; ``ours_several`` and ``ours_near``, which
            differ from ``ours``; ``paper``, or a new one), then by dotted name, as ``slap train
            --set`` has it.
        ablations: Interfaces that each lack one of the terms that were made by hand for this
            domain, by the name of what is left out, and a plain one. ``slap study ablation``
            compares them.
    """

    interface: LearnerInterface
    actions: ActionSpace | None = None
    make_vector_world: MakeVectorWorld | None = None
    settings: Mapping[str, Mapping[str, SettingValue]] = field(default_factory=dict)
    ablations: Mapping[str, LearnerInterface] = field(default_factory=dict)
