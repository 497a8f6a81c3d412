# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The planner's model: options rolled out in a world of its own, and remembered."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import ActionSpace, Domain, World
from slap_ros.errors import SkillNotApplicableError
from slap_ros.planning.options import Option, OptionExecution, OptionResult
from slap_ros.relational import AtomSpace, State


@dataclass(frozen=True)
class Rollout:
    """What came of an option in the model."""

    reached: bool  # the target abstract state
    steps: int  # environment steps
    final: State


class Model:
    """The known transition function (the paper's f).

    A roll-out is a function of the option, its target and the state, bit for bit, so each is
    done once.
    """

    def __init__(self, world: World, space: AtomSpace, actions: ActionSpace) -> None:
        """Plan in ``world``, which nobody else may use."""
        self.space = space
        self.executed = 0  # roll-outs done so far, remembered ones not counted
        self._world = world
        self._actions = actions
        self._memory: dict[tuple[Option, int, bytes], Rollout] = {}

    @classmethod
    def of(cls, domain: Domain, initial: State) -> Model:
        """A model for the tasks over these objects."""
        return cls(domain.make_world(initial), domain.atom_space(initial), domain.action_space)

    def roll_out(self, option: Option, state: State, target: int) -> Rollout:
        """Run an option until ``target``, an abstract state, is reached or it stops."""
        key = (option, target, state.key)
        if key not in self._memory:
            self.executed += 1
            self._memory[key] = self._simulate(option, state, target)
        return self._memory[key]

    def _simulate(self, option: Option, state: State, target: int) -> Rollout:
        self._world.reset(state)
        try:
            execution = OptionExecution(option, target, self._actions, state)
        except SkillNotApplicableError:
            return Rollout(False, 0, state)
        while True:
            action = execution.advance(state, self.space.abstract(state))
            if isinstance(action, OptionResult):
                return Rollout(action.reached, execution.steps, state)
            state = self._world.step(action)
