# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An episode of a task environment: the task, its atoms, and how far it has come."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from slap_ros.core import Domain, Task
from slap_ros.relational import AtomSpace, Object, State


@dataclass
class TaskEpisode:
    """A task that is under way.

    Args:
        domain: Domain of the task.
        task: Task to be solved.
        space: Atoms of the task.
        goal: Mask of the atoms that must hold.
        state: Newest state.
        steps: Environment steps so far.
        stage: Objects of the present operator of the task's plan, where a reward follows one.
    """

    domain: Domain
    task: Task
    space: AtomSpace
    goal: int
    state: State
    steps: int = 0
    stage: tuple[Object, ...] = ()
    _abstracted: tuple[State, int] | None = field(default=None, init=False, repr=False)
    _named: tuple[int, tuple[str, ...]] | None = field(default=None, init=False, repr=False)

    @classmethod
    def of(cls, domain: Domain, task: Task) -> TaskEpisode:
        """The beginning of a task.

        Raises:
            UnknownObjectError: The goal has objects that are not in the state.
        """
        space = domain.atom_space(task.initial_state)
        return cls(domain, task, space, space.mask(task.goal), task.initial_state)

    @property
    def abstract(self) -> int:
        """The atoms that hold, a mask; worked out once for each state."""
        if self._abstracted is None or self._abstracted[0] is not self.state:
            self._abstracted = self.state, self.space.abstract(self.state)
        return self._abstracted[1]

    @property
    def atom_names(self) -> tuple[str, ...]:
        """The names of the atoms that hold, which most steps leave as they were."""
        abstract = self.abstract
        if self._named is None or self._named[0] != abstract:
            self._named = abstract, tuple(map(str, self.space.decode(abstract)))
        return self._named[1]

    @cached_property
    def goal_names(self) -> tuple[str, ...]:
        """The names of the atoms that must hold, in order."""
        return tuple(sorted(map(str, self.task.goal)))

    @property
    def solved(self) -> bool:
        """Whether the goal holds."""
        return self.goal & ~self.abstract == 0

    @property
    def at_limit(self) -> bool:
        """Whether the task allows no further step."""
        return self.steps >= self.task.step_limit
