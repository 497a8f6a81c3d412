# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Perception without error."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.perception.percept import Percept
from slap_ros.relational import AtomSpace, State


@dataclass(frozen=True)
class ExactPerceiver:
    """The state as it is, and the domain's own predicates.

    Args:
        space: Ground atoms of the task.
        changing: Whether the world may change while the robot holds still, otherwise than planners
            know, so that it is worth to look again.
    """

    space: AtomSpace
    changing: bool = False

    def perceive(self, state: State) -> Percept:
        """The state itself and its atoms; see :class:`~slap_ros.perception.percept.Perceiver`."""
        return Percept(state, self.space.abstract(state), exact=not self.changing)
