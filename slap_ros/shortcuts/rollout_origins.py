# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where rollouts of exploration begin: where options end, and along the way that they take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from slap_ros.core import ActionSpace, World
from slap_ros.errors import SkillNotApplicableError
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.search import Vertex
from slap_ros.relational import AtomSpace, State, Target
from slap_ros.relational.state import Array


@dataclass(frozen=True)
class RolloutOrigin:
    """A state in which rollouts begin.

    Args:
        vertex: Vertex at the state, or before it on the way.
        state: State in which rollouts begin.
        steps: Environment steps from the vertex to the state.
        onwards: Policy's action that moves the hand on towards what an approach has brought it
            near; None where there was no approach.
    """

    vertex: Vertex
    state: State
    steps: int = 0
    onwards: Array | None = field(default=None, compare=False)

    @property
    def g(self) -> int:
        """Environment steps from the start of the task."""
        return self.vertex.g + self.steps


class OptionRetracer:
    """Executes options again, to see the states on their way."""

    def __init__(self, world: World, space: AtomSpace, actions: ActionSpace) -> None:
        """Take a world that nobody else uses.

        Args:
            world: World in which options are executed.
            space: Atoms of the task.
            actions: Action space of the robot.
        """
        self._world, self._space, self._actions = world, space, actions
        self.steps = 0  # environment steps so far

    def inside(self, vertex: Vertex, target: Target, every: int) -> Iterator[RolloutOrigin]:
        """Execute the option that led to a vertex once more.

        Args:
            vertex: Vertex that the option led to.
            target: Target of the option.
            every: Environment steps from one of the states to the next.

        Yields:
            States along its way, in equal numbers of steps; neither the first nor the last.
        """
        if vertex.parent is None or vertex.edge is None:
            return
        state = vertex.parent.state
        self._world.reset(state)
        try:
            option = vertex.edge.option
            execution = OptionExecution(option, target, self._space, self._actions, state)
        except SkillNotApplicableError:
            return
        while True:
            action = execution.advance(state, self._space.abstract(state))
            if isinstance(action, OptionResult):
                return
            state = self._world.step(action)
            self.steps += 1
            if execution.steps % every == 0 and execution.steps < vertex.g - vertex.parent.g:
                yield RolloutOrigin(vertex.parent, state, execution.steps)
