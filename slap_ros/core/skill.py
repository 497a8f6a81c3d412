# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills: the control side of operators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from slap_ros.core.action_space import Action
from slap_ros.relational import Object, State

Policy = Callable[[State], Action | None]  # None: nothing left to do


class Skill(Protocol):
    """The control side of an operator, given or learned, for any objects.

    Everything is a function of its arguments: the same state gives the same policy and the same
    bounds, so that planning, execution and replay agree and roll-outs can be remembered.
    """

    @property
    def name(self) -> str:
        """The operator's or shortcut's name."""
        ...

    @property
    def step_limit(self) -> int:
        """Environment steps after which it counts as failed."""
        ...

    @property
    def least_steps(self) -> int:
        """Environment steps that it takes at least, from any state."""
        ...

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """Environment steps that it takes at least from this state. Never too many."""
        ...

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Begin in this state.

        Raises:
            SkillNotApplicableError: It cannot start here.
        """
        ...
