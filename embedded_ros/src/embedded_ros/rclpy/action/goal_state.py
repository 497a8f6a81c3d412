# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A goal's states and the transitions between them, as in rcl_action."""

from __future__ import annotations

from enum import IntEnum


class GoalState(IntEnum):
    """The states, numbered as in action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_active(self) -> bool:
        """Whether the goal is not finished."""
        return self in (GoalState.ACCEPTED, GoalState.EXECUTING, GoalState.CANCELING)


class GoalEvent(IntEnum):
    """What changes a goal's state."""

    EXECUTE = 1
    CANCEL_GOAL = 2
    SUCCEED = 3
    ABORT = 4
    CANCELED = 5


class InvalidTransitionError(RuntimeError):
    """A goal was told what it cannot do in its state."""


_TRANSITIONS = {
    (GoalState.ACCEPTED, GoalEvent.EXECUTE): GoalState.EXECUTING,
    (GoalState.ACCEPTED, GoalEvent.CANCEL_GOAL): GoalState.CANCELING,
    (GoalState.EXECUTING, GoalEvent.CANCEL_GOAL): GoalState.CANCELING,
    (GoalState.EXECUTING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.EXECUTING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.SUCCEED): GoalState.SUCCEEDED,
    (GoalState.CANCELING, GoalEvent.ABORT): GoalState.ABORTED,
    (GoalState.CANCELING, GoalEvent.CANCELED): GoalState.CANCELED,
}


def next_state(state: GoalState, event: GoalEvent) -> GoalState:
    """The state that an event leads to; raises InvalidTransitionError where there is none."""
    try:
        return _TRANSITIONS[state, event]
    except KeyError:
        raise InvalidTransitionError(
            f"goal in state {state.name} cannot take the transition {event.name}"
        ) from None
