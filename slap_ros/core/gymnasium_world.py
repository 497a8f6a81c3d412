# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gymnasium environments as worlds.

What an environment needs beyond Gymnasium's own interface:

- observations are dictionaries of arrays: each object's features, by the object's name, in the
  order and the units of its :class:`~slap_ros.relational.Type`, and *everything* that the next
  step depends on is among them;
- ``reset(options={"state": observation})`` continues from that observation, exactly;
- actions are arrays with one entry per axis of the action space, in its order.

Numbers are float64: what is rounded to float32 does not come back exactly. Rewards and ends of
episodes are not read: tasks have goals. Wrappers that end episodes, or change observations, are
better left off (``env.unwrapped``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from slap_ros.core import Action, ActionSpace
from slap_ros.core.environment_returns import (
    advised,
    described,
    errors_of,
    require_begun,
    reset_observation,
    state_from,
    step_observation,
)
from slap_ros.errors import InvalidDomainError, InvalidStateError
from slap_ros.relational import Layout, State

Observation = Mapping[str, Any]  # object name to its features, arrays


class Environment(Protocol):
    """As much of ``gymnasium.Env`` as is used; it need not be installed to plan."""

    def reset(self, *, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Continue from ``options["state"]``."""
        ...

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Act for one control period."""
        ...


class GymnasiumWorld:
    """An environment that is reset to states and stepped; see ``slap_ros.core.World``."""

    def __init__(self, environment: Environment, state: State, actions: ActionSpace) -> None:
        """Begin in ``state``.

        Args:
            environment: Environment to step; nothing else may use it.
            state: State to begin in.
            actions: Actions of the robot.

        Raises:
            InvalidDomainError: It does not keep to what this module asks for.
            InvalidStateError: It refuses the state.
        """
        self._environment, self._actions = environment, actions
        self.reset(state)

    @classmethod
    def maker(
        cls, make_environment: Callable[[], Environment], actions: ActionSpace
    ) -> Callable[[State], GymnasiumWorld]:
        """What a domain needs as ``make_world``: each world has an environment of its own."""
        return lambda state: cls(make_environment(), state, actions)

    @property
    def state(self) -> State:
        """The current state."""
        return self._state

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidDomainError: The environment does not begin in that state.
            InvalidStateError: It refuses the state, by a ``ValueError``.
        """
        state.require_finite()
        observation = self._reset_to(state)
        with advised(self._environment):
            begun = state_of(state.layout, observation)
            require_begun(state, begun, 'reset(options={"state": ...})')
        self._state = state

    def _reset_to(self, state: State) -> Any:
        with errors_of(self._environment, "reset"):
            try:
                returned = self._environment.reset(options={"state": observation_of(state)})
            except ValueError as error:
                raise InvalidStateError(f"the environment refuses this state: {error}") from error
        return reset_observation(returned, self._environment)

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
            InvalidDomainError: What the environment observes does not fit the objects, or it
                raises.
        """
        self._actions.check(action)
        with errors_of(self._environment, "step"):
            returned = self._environment.step(action)
        observation = step_observation(returned, self._environment)
        with advised(self._environment):
            self._state = state_of(self._state.layout, observation)
        return self._state


def observation_of(state: State) -> dict[str, Any]:
    """The features of each object by name, copied."""
    return {obj.name: np.array(state[obj]) for obj in state.layout.objects}


def state_of(layout: Layout, observation: Observation) -> State:
    """The state that an environment observes.

    Raises:
        InvalidDomainError: No dictionary, other objects, another number of features, or no numbers.
    """
    if not isinstance(observation, Mapping):
        raise InvalidDomainError(
            f"the environment observes {described(observation)}; a dictionary is wanted that has "
            f"the features of {', '.join(obj.name for obj in layout.objects)} by name"
        )
    return state_from(layout, observation)
