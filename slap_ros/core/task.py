# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task: an initial state, a goal, and a step limit."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.relational import GroundAtom, State


@dataclass(frozen=True)
class Task:
    """Where to start, what to reach, and in how many environment steps."""

    initial_state: State
    goal: frozenset[GroundAtom]
    step_limit: int
