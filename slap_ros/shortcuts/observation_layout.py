# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which features a shortcut observes: those of the robot, and those of each object with a role."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import Domain
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace, Column, Object, State
from slap_ros.shortcuts.signature import Kind, Signature, kinds


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


class SlotGroup(NamedTuple):
    """The objects of one kind that a shortcut observes."""

    slots: int  # for them in an observation
    column: Column  # the objects
    numbers: NDArray[np.intp]  # of the objects among all that the shortcut is about


def slot_groups(
    signature: Signature, space: AtomSpace, objects: Sequence[Object]
) -> list[SlotGroup]:
    """The objects that a shortcut is about, by kind.

    Args:
        signature: Signature of the shortcut, whose slots an observation has.
        space: Atoms of the task.
        objects: Objects that the shortcut is about.
    """
    by_kind: dict[Kind, list[int]] = {name: [] for name in signature.slots}
    for number, obj in enumerate(objects):
        by_kind[kinds(space)[obj]].append(number)
    return [
        SlotGroup(
            signature.slots[name],
            Column(tuple(objects[number] for number in numbers)),
            np.array(numbers, dtype=np.intp),
        )
        for name, numbers in by_kind.items()
    ]
