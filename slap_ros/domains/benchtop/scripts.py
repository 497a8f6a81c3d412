# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What scripts are made of: moves of the hand, one after the other, each in closed loop.

A script gives a policy for an operator's objects: ``follow(*over(...), Move(...), ...)``. Where a
move goes may depend on how things are in each step, so a script corrects what slips or is pushed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from slap_ros.core import Action, Policy
from slap_ros.domains.benchtop.features import PLACE
from slap_ros.domains.benchtop.hand_motion import (
    CLOSE,
    KEEP,
    OPEN,
    GoalOf,
    HandGoal,
    action_towards,
)
from slap_ros.domains.benchtop.state_access import (
    finger_opening,
    hand_position,
    hand_target,
    held_thing,
    position_of,
    value,
)
from slap_ros.geometry.pose import Vector
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.world import MAX_SHIFT
from slap_ros.worlds.panda import FINGER_OPEN

PATIENCE = 60  # environment steps after which a move is given up and the next one begins
GRIP_STEPS = 10  # environment steps that closing or opening takes at most
FIRM_STEPS = 3  # environment steps for which fingers press before they lift
GENTLE = 0.008  # m a step, near what is touched
CLEARANCE = 0.03  # m between what the hand carries and what it travels over
BELOW_GRASP = 0.01  # m that the fingers reach below the grasp point

Condition = Callable[[State], bool]


@dataclass(frozen=True)
class Move:
    """Go on towards a goal until something holds.

    Args:
        to: Goal of the hand, or a function that gives it in each step.
        gripper: Gripper command: OPEN, KEEP or CLOSE.
        until: Condition that ends the move; if it is left out, the move ends when the hand is
            there.
        fastest: Largest shift along each axis in one control step, m.
        patience: Number of environment steps after which the move is given up.
    """

    to: HandGoal | GoalOf
    gripper: float = KEEP
    until: Condition | None = None
    fastest: float = MAX_SHIFT
    patience: int = PATIENCE

    def goal(self, state: State) -> HandGoal:
        """The goal of the hand in a state."""
        return self.to(state) if callable(self.to) else self.to

    def done(self, state: State) -> bool:
        """Whether the move is done."""
        return self.until(state) if self.until else self.goal(state).reached(state)

    def action(self, state: State) -> Action:
        """The action of one step."""
        return action_towards(state, self.goal(state), self.gripper, self.fastest)


class MoveSequence:
    """A policy that carries moves out, one after the other; None after the last one."""

    def __init__(self, moves: tuple[Move, ...]) -> None:
        self._moves = deque(moves)
        self._steps = 0  # of the first one

    def __call__(self, state: State) -> Action | None:
        """The next action."""
        while self._moves:
            move = self._moves[0]
            if self._steps < move.patience and not move.done(state):
                self._steps += 1
                return move.action(state)
            self._moves.popleft()
            self._steps = 0
        return None


def follow(*moves: Move) -> Policy:
    """The policy that carries moves out, one after the other."""
    return MoveSequence(moves)


# -- blocks ---------------------------------------------------------------------------------------


def over(
    state: State, goal: HandGoal, gripper: float = KEEP, height: float | None = None
) -> tuple[Move, Move]:
    """The moves up to a height at which the hand touches nothing, then over a goal.

    Args:
        state: State in which the moves begin.
        goal: Goal that the hand is to be over, with the same yaw.
        gripper: Gripper command: OPEN, KEEP or CLOSE.
        height: Height of the grasp point, m; :func:`travel_height` if left out.
    """
    z = travel_height(state) if height is None else height
    z = max(z, goal.position[2], hand_position(state)[2])
    _, yaw = hand_target(state)
    up = HandGoal(hand_position(state), yaw).at_height(z)
    return Move(up, gripper), Move(goal.at_height(z), gripper)


def hold_still(gripper: float, until: Condition, patience: int = GRIP_STEPS) -> Move:
    """The move that stays where the hand is until something holds.

    Args:
        gripper: Gripper command: OPEN, KEEP or CLOSE.
        until: Condition that ends the move.
        patience: Number of environment steps after which the move is given up.
    """
    return Move(_here, gripper, until, patience=patience)


def grasp(thing: Object) -> tuple[Move, Move]:
    """The moves that close the fingers around a thing and let them press for a moment."""
    return close_around(lambda state: value(state, thing, "held") > 0.5)


def close_around(is_held: Condition) -> tuple[Move, Move]:
    """The moves that close the fingers until something is held, and let them press for a moment.

    Args:
        is_held: Condition that says whether it is.
    """
    return hold_still(CLOSE, is_held), hold_still(CLOSE, _never, patience=FIRM_STEPS)


def release() -> Move:
    """The move that opens the fingers."""
    return hold_still(OPEN, fingers_open)


def carry(
    thing: Object, to: Vector | Callable[[State], Vector], yaw: float | None = None
) -> GoalOf:
    """Where the hand must be for what it holds to be somewhere.

    Args:
        thing: Thing in the hand.
        to: Position that the thing's origin is to have, m, or a function that gives it in each
            step.
        yaw: Yaw of the hand, rad; the present yaw of its target if left out.
    """

    def goal(state: State) -> HandGoal:
        wanted = to(state) if callable(to) else to
        hand, origin = hand_position(state), position_of(state, thing)
        x, y, z = (h + w - o for h, w, o in zip(hand, wanted, origin, strict=True))
        return HandGoal((x, y, z), hand_target(state)[1] if yaw is None else yaw)

    return goal


def fingers_open(state: State) -> bool:
    """Whether the fingers are as far apart as they go."""
    return finger_opening(state) >= 2.0 * FINGER_OPEN - 0.002


def travel_height(state: State) -> float:
    """A height at which the hand and what it holds pass over everything, m.

    Everything is as high as things can stand on it; a domain of other shapes gives its own height.
    """
    held = held_thing(state)
    tops = [
        value(state, place, "z") + value(state, place, "support_height")
        for place in state.layout.of_type(PLACE)
        if place is not held
    ]
    below = BELOW_GRASP
    if held is not None:
        underside = value(state, held, "z") - value(state, held, "rest_height")
        below = max(below, hand_position(state)[2] - underside)
    return max(tops, default=0.0) + CLEARANCE + below


def _here(state: State) -> HandGoal:
    """Where the hand was told to be: what it leans on goes on being leaned on."""
    position, yaw = hand_target(state)
    return HandGoal(position, yaw)


def _never(_: State) -> bool:
    return False
