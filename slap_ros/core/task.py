# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task: an initial state, a goal, and a step limit."""

from __future__ import annotations

from dataclasses import dataclass, field

from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.relational import GroundAtom, State

UNSAMPLED = -1  # seed of a task that was given or measured, not sampled


@dataclass(frozen=True, repr=False)
class Task(ShownInNotebooks):
    """Where to start, what to reach, and in how many environment steps.

    Args:
        initial_state: State in which the task begins.
        goal: Atoms that must hold at the end.
        step_limit: Largest number of environment steps.
        seed: Seed that sampled the task, or ``UNSAMPLED``; of two equal tasks it may differ.
        index: Index of the task among those of its seed.
    """

    initial_state: State
    goal: frozenset[GroundAtom]
    step_limit: int
    seed: int = field(default=UNSAMPLED, compare=False)
    index: int = field(default=0, compare=False)

    def __str__(self) -> str:
        """The goal, and what sampled the task."""
        origin = "given" if self.seed == UNSAMPLED else f"seed {self.seed}, index {self.index}"
        return f"{', '.join(sorted(map(str, self.goal)))} ({origin})"
