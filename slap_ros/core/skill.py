# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills: the control side of operators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from slap_ros.core.action_space import Action
from slap_ros.relational import Object, State

Policy = Callable[[State], Action | None]  # None: nothing left to do


@runtime_checkable
class ForeseeingPolicy(Protocol):
    """A policy that was tried out in the planner's model, and knows what came of it there."""

    def __call__(self, state: State) -> Action | None:
        """See :data:`Policy`."""
        ...

    @property
    def foreseen(self) -> State | None:
        """The state after the newest action in the model; None where that is not known."""
        ...


class Skill(Protocol):
    """The control side of an operator, given or learned, for any objects.

    Everything is a function of its arguments: the same state gives the same policy and the same
    bounds, so that planning, execution and replay agree and roll-outs can be cached.
    """

    @property
    def name(self) -> str:
        """The operator's or shortcut's name."""
        ...

    @property
    def step_limit(self) -> int:
        """Environment steps after which the skill counts as failed."""
        ...

    @property
    def least_steps(self) -> int:
        """Environment steps that the skill takes at least, from any state: a lower bound."""
        ...

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """A lower bound of the environment steps that the skill takes from a state.

        Lazy search finds a cheapest plan only if the bound never exceeds the true steps.

        Args:
            state: State in which the skill would begin.
            objects: Objects that the skill is applied to.

        Returns:
            Environment steps, at least 0.
        """
        ...

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Begin the skill in a state.

        Args:
            state: State in which the skill begins.
            objects: Objects that the skill is applied to.

        Returns:
            The policy, to be called once per environment step.

        Raises:
            SkillNotApplicableError: It cannot start here.
        """
        ...


@runtime_checkable
class DemandingSkill(Skill, Protocol):
    """A skill that does not end in every state in which its target is reached."""

    def accepts(self, state: State, objects: tuple[Object, ...]) -> bool:
        """Whether the skill may end in a state in which its target is reached.

        Args:
            state: Current state.
            objects: Objects that the skill is applied to.
        """
        ...


@runtime_checkable
class GradualSkill(Skill, Protocol):
    """A skill of which it is found out bit by bit how many steps it takes."""

    def raised_bound(self, state: State, objects: tuple[Object, ...], steps: int) -> int:
        """Find out more about how many steps the skill takes from a state.

        Args:
            state: State in which the skill would begin.
            objects: Objects that the skill is applied to.
            steps: Lower bound of the environment steps that is known.

        Returns:
            A higher bound, or ``steps`` where the skill may take so many, or cannot start.
        """
        ...


@runtime_checkable
class ProvingSkill(Skill, Protocol):
    """A skill that knows more of its steps than searches for plans go by.

    What it knows counts in proofs alone, so that plans do not depend on it.
    """

    def least_steps_in_plans(self, initial: State, follows: bool) -> int:
        """Environment steps that it takes at least in plans that begin in a state.

        Args:
            initial: State in which the plans begin.
            follows: Whether it comes right after another given skill, and does not lead back to
                the abstract state in which that began; else it may begin in any state.
        """
        ...
