# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract states that operators reach, as many as can be looked at."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from slap_ros.relational import GroundOperator

# A model may answer with operators of thousands of groundings, each of which is looked at in every
# abstract state. So the work is bounded, to some seconds, and not the states alone.
MAX_WORK = 10_000_000  # ground operators looked at, in all states together
MAX_STATES = 20_000  # abstract states


@dataclass(frozen=True)
class ReachableStates:
    """The abstract states that can be reached from the initial one.

    Args:
        states: The states, as masks.
        ever_true: Atoms that hold in one of them, a mask; where they are not all, the atoms that
            could be reached if nothing were ever deleted.
        complete: Whether these are all.
    """

    states: frozenset[int]
    ever_true: int
    complete: bool

    @classmethod
    def of(cls, start: int, operators: Sequence[GroundOperator]) -> ReachableStates:
        """Enumerate them, breadth first.

        Args:
            start: Initial abstract state, a mask.
            operators: Ground operators.
        """
        found, queue = {start}, deque([start])
        ever_true, most = start, most_states(operators)
        while queue:
            state = queue.popleft()
            for operator in operators:
                if not operator.applicable(state):
                    continue
                successor = operator.apply(state)
                if successor not in found:
                    if len(found) == most:
                        return cls(frozenset(found), _relaxed(start, operators), False)
                    found.add(successor)
                    queue.append(successor)
                    ever_true |= successor
        return cls(frozenset(found), ever_true, True)


def most_states(operators: Sequence[GroundOperator]) -> int:
    """How many abstract states may be looked at with so many ground operators."""
    return min(MAX_STATES, MAX_WORK // max(1, len(operators)))


def _relaxed(start: int, operators: Sequence[GroundOperator]) -> int:
    """The atoms that could be reached if nothing were ever deleted."""
    reached, before = start, -1
    while reached != before:
        before = reached
        for operator in operators:
            if operator.applicable(reached):
                reached |= operator.add_effects
    return reached
