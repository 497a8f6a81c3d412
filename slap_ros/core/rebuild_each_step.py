# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Simulators that are not Markov, made Markov by building a new one from the state in each step.

Physics engines keep more than their states tell: impulses of the last step to begin the next one
with (warm starts), contacts, what a controller remembers. A simulator that was just built has none
of this, so what it does next depends on the state alone. The price is the building, in each step,
and that what was kept is lost: motion differs a little from that of a simulator that runs on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from slap_ros.core.action_space import Action, ActionSpace
from slap_ros.core.environment_returns import described, require_begun, require_numbers
from slap_ros.errors import InvalidDomainError
from slap_ros.relational import State


class Simulator(Protocol):
    """What is built from a state, and stepped once."""

    def step(self, action: Action) -> State:
        """Act for one control period."""
        ...


MakeSimulator = Callable[[State], Simulator]  # a new one in each call, sharing nothing


class RebuildEachStep:
    """A world whose every step is the first of a new simulator; see ``slap_ros.core.World``."""

    def __init__(self, make: MakeSimulator, state: State, actions: ActionSpace) -> None:
        """Begin in ``state``.

        Args:
            make: Builds a simulator in a state. It has to be a function of that state: simulators
                share nothing that changes.
            state: State to begin in.
            actions: Actions of the robot.

        Raises:
            InvalidStateError: The state is not finite, or ``make`` refuses it.
        """
        self._make, self._actions = make, actions
        self.reset(state)

    @classmethod
    def maker(cls, make: MakeSimulator, actions: ActionSpace) -> Callable[[State], RebuildEachStep]:
        """What a domain needs as ``make_world``."""
        return lambda state: cls(make, state, actions)

    @property
    def state(self) -> State:
        """The current state."""
        return self._state

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: It is not finite, or ``make`` refuses it.
            InvalidDomainError: What is made cannot be stepped, or begins in another state.
        """
        state.require_finite()
        # Built at once, so that a state is refused here and not in the next step.
        self._built: Simulator | None = self._build(state)
        self._state = state

    def _build(self, state: State) -> Simulator:
        simulator = self._make(state)
        if not callable(getattr(simulator, "step", None)):
            raise InvalidDomainError(
                f"make_simulator(state) returned {described(simulator)}; it must return something "
                "with step(action)"
            )
        begun = getattr(simulator, "state", None)  # few tell
        if isinstance(begun, State) and begun.layout == state.layout:
            require_begun(state, begun, "make_simulator(state)")
        return simulator

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
            InvalidDomainError: What the simulator returns is no state of these objects.
        """
        self._actions.check(action)
        simulator, self._built = self._built or self._build(self._state), None
        self._state = self._checked(simulator.step(action), simulator)
        return self._state

    def _checked(self, after: object, simulator: Simulator) -> State:
        name = type(simulator).__name__
        if not isinstance(after, State):
            raise InvalidDomainError(
                f"step of {name} returned {described(after)}; it must return the State after it, "
                "as slap_ros.core.gymnasium_world.state_of(layout, observation) makes it"
            )
        if after.layout != self._state.layout:
            raise InvalidDomainError(
                f"step of {name} returned a state of {_names(after)}; the objects are "
                f"{_names(self._state)}, in this order"
            )
        require_numbers(after, f"step of {name} returned")
        return after


def _names(state: State) -> str:
    return ", ".join(obj.name for obj in state.layout.objects)
