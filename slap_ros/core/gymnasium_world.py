# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gymnasium environments as worlds.

What an environment needs beyond Gymnasium's own interface:

- observations are dictionaries of arrays: each object's features, by the object's name, in the
  order and the units of its :class:`~slap_ros.relational.Type`, and *everything* that the next
  step depends on is among them;
- ``reset(options={"state": observation})`` continues from that observation, exactly;
- actions are arrays with one entry per axis of the action space, in its order.

Rewards and ends of episodes are not read: tasks have goals. Wrappers that end episodes are better
left off (``env.unwrapped``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from slap_ros.core import Action, ActionSpace
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
        try:
            observation, _ = self._environment.reset(options={"state": observation_of(state)})
        except ValueError as error:
            raise InvalidStateError(f"the environment refuses this state: {error}") from error
        begun = state_of(state.layout, observation)
        if not np.array_equal(begun.data, state.data):
            obj = next(o for o in state.layout.objects if not np.array_equal(begun[o], state[o]))
            raise InvalidDomainError(
                f"reset to a state in which {obj.name} is {state[obj]}, the environment begins "
                f'with {begun[obj]}; reset(options={{"state": ...}}) must continue from it exactly'
            )
        self._state = state

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
            InvalidDomainError: What the environment observes does not fit the objects.
        """
        self._actions.check(action)
        observation, *_ = self._environment.step(action)
        self._state = state_of(self._state.layout, observation)
        return self._state


def observation_of(state: State) -> dict[str, Any]:
    """The features of each object by name, copied."""
    return {obj.name: np.array(state[obj]) for obj in state.layout.objects}


def state_of(layout: Layout, observation: Observation) -> State:
    """The state that an environment observes.

    Raises:
        InvalidDomainError: Other objects, or another number of features.
    """
    names = [obj.name for obj in layout.objects]
    if set(observation) != set(names):
        raise InvalidDomainError(
            f"the environment observes {', '.join(sorted(observation))}; the objects are "
            f"{', '.join(sorted(names))}"
        )
    data = np.empty(layout.size)
    for obj, part in layout.slices.items():
        features = np.asarray(observation[obj.name], dtype=float)
        if features.shape != (part.stop - part.start,):
            raise InvalidDomainError(
                f"the environment observes {obj.name} with shape {features.shape}; a {obj.type} "
                f"has {', '.join(feature.name for feature in obj.type.features)}"
            )
        data[part] = features
    return State(layout, data)
