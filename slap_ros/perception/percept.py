# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a state, and who finds it out."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from slap_ros.relational import Layout, State


@dataclass(frozen=True)
class Percept:
    """A state as it is perceived."""

    state: State  # of the known objects, with poses as they are taken to be
    abstract: int  # atoms as they are taken to hold; none about a missing object does
    missing: frozenset[str] = frozenset()  # objects of which nobody knows where they are
    exact: bool = True  # whether another look would find the same


def known_part(state: State, missing: Collection[str]) -> State:
    """A state without the objects that are missing.

    If all objects of a type are, the state stays whole: predicates need one of each.

    Args:
        state: State with every object of the task.
        missing: Names of the missing objects.
    """
    known = tuple(obj for obj in state.objects if obj.name not in missing)
    if {obj.type for obj in known} != {obj.type for obj in state.objects}:
        return state
    return state.over(Layout.of(known))


class Perceiver(Protocol):
    """Perceives the states of an episode, each once and in order."""

    def perceive(self, state: State) -> Percept:
        """What is known of a state.

        Raises:
            InvalidStateError: It has other objects than the episode.
        """
        ...
