# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a state, and who finds it out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from slap_ros.relational import State


@dataclass(frozen=True)
class Percept:
    """A state as it is perceived."""

    state: State  # with poses as they are taken to be
    abstract: int  # atoms as they are taken to hold
    missing: frozenset[str] = frozenset()  # objects of which nobody knows any more where they are
    exact: bool = True  # whether another look would find the same


class Perceiver(Protocol):
    """Perceives the states of an episode, each once and in order."""

    def perceive(self, state: State) -> Percept:
        """What is known of a state.

        Raises:
            InvalidStateError: It has other objects than the episode.
        """
        ...
