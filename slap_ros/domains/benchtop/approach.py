# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The approach: what brings the hand to where a skill begins (LG-SAIL's transition primitive).

It ends 0.04 m before where the skill acts, and up to 25 mm aside of that: a real motion planner
knows where things are to some millimetres, and what a skill finds must not be done already. It
goes up to where nothing is in the way, over, and down, in closed loop.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slap_ros.core import Approach, Policy
from slap_ros.domains.benchtop.features import THING
from slap_ros.domains.benchtop.hand_motion import CLOSE, KEEP, OPEN, HandGoal
from slap_ros.domains.benchtop.scripts import Move, follow, over, release, travel_height
from slap_ros.domains.benchtop.state_access import hand_position, hand_target, held_thing
from slap_ros.geometry.pose import Vector
from slap_ros.relational import Object, State
from slap_ros.worlds.contact.world import MAX_SHIFT

DISTANCE = 0.04  # m before where the skill acts (LG-SAIL §5.1)
# What is stacked is within 10 mm, so opening the fingers where a skill begins stacks nothing.
ASIDE = (0.015, 0.025)  # m, least and most
HELD_STEPS = 6  # environment steps after which a hand that should be away is held by something
TRIES = 3  # at freeing it
RELAXED = 0.01  # m, from a hand to where it is pulled
RELAX_STEPS = 4  # environment steps at most; two take it as far as it can be pulled
STRAIGHT = (0.0, 0.0)  # rad, turned neither way
UP: Vector = (0.0, 0.0, 1.0)

# Where an operator's skill acts: where the hand is to be when it touches what the last object
# names, or when what it holds is at its place.
ActsAt = Callable[[State, tuple[Object, ...]], HandGoal]
# Of length 1: from there to where the skill is approached from.
Outwards = Callable[[State, tuple[Object, ...]], Vector]
# The moves of an empty hand, the last of which goes up to where nothing is in the way.
Leave = Callable[[State, Move], tuple[Move, ...]]


def from_above(state: State, objects: tuple[Object, ...]) -> Vector:
    """The direction straight up."""
    del state, objects
    return UP


def carried(state: State, objects: tuple[Object, ...]) -> Object | None:
    """The object in the hand, if there is another one to which it is brought.

    What is grasped and is none of a skill's objects, or the only one, is let go first: a pick that
    failed halfway begins again.
    """
    held = held_thing(state)
    return held if held in objects and len(objects) > 1 else None


def acted_on(state: State, objects: tuple[Object, ...]) -> Object:
    """What a skill acts on: an operator that was not written by hand has its objects in any order.

    It is what the carried object is brought to; else the thing that is named; else the last object.
    """
    brought = carried(state, objects)
    others = [obj for obj in objects if (obj is not brought if brought else obj.type.is_a(THING))]
    return (others or objects)[-1]


def withdraw(state: State, up: Move) -> tuple[Move, ...]:
    """The moves of a hand up from where it has nothing to do any more.

    What it holds is let go. An empty hand goes as it is: fingers that open push a drawer shut that
    they are in. Learned skills end where that works (``can_leave``); where it does not, closing and
    opening them frees the hand from most of what it is caught in.

    Args:
        state: State in which the hand begins to go up.
        up: The move up to where nothing is in the way.
    """
    if held_thing(state) is not None:
        return release(), up
    steps = math.ceil((up.goal(state).position[2] - hand_position(state)[2]) / MAX_SHIFT)
    first = replace(up, gripper=KEEP, patience=steps + HELD_STEPS)
    opened, closed = (replace(up, gripper=told, patience=HELD_STEPS) for told in (OPEN, CLOSE))
    return (first, *(TRIES * (opened, closed)), opened)


def relax_and_withdraw(state: State, up: Move) -> tuple[Move, ...]:
    """:func:`withdraw` for a hand that may be pressed against walls.

    On its way up these would let it go with a jerk to where it is pulled, and it would take along
    what stands between its fingers. So it is first pulled to where it is.

    Args:
        state: State in which the hand begins to go up.
        up: The move up to where nothing is in the way.
    """
    return Move(_as_it_is, until=_is_relaxed, patience=RELAX_STEPS), *withdraw(state, up)


def make_approach(
    acts_at: ActsAt,
    outwards: Outwards = from_above,
    height: Callable[[State], float] = travel_height,
    turned: tuple[float, float] = STRAIGHT,
    leave: Leave = withdraw,
) -> Approach:
    """The approach of a domain.

    Args:
        acts_at: Function from state and objects to the hand's goal where a skill acts.
        outwards: Function from state and objects to the unit vector from where the skill acts to
            where it begins.
        height: Function from a state to the height of the grasp point while it travels, m.
        turned: Least and most angle by which a hand that holds something is turned, when the skill
            begins, from its yaw where the skill acts, rad.
        leave: Function that gives the moves of an empty hand up from where it is.
    """

    def approach(state: State, objects: tuple[Object, ...]) -> Policy:
        empty = carried(state, objects) is None
        acts, out = acts_at(state, objects), outwards(state, objects)
        goal = begin_at(state, objects, acts, out, STRAIGHT if empty else turned)
        gripper = OPEN if empty else KEEP
        up, across = over(state, goal, gripper, height(state))
        rise = leave(state, up) if empty else (up,)
        return follow(*rise, across, Move(goal, gripper))

    return approach


def begin_at(
    state: State,
    objects: tuple[Object, ...],
    goal: HandGoal,
    outwards: Vector,
    turned: tuple[float, float],
) -> HandGoal:
    """Where a skill begins: before where it acts, somewhat aside, and turned if need be.

    Args:
        state: State in which the approach begins. It decides how far aside the skill begins, and to
            which side.
        objects: Objects of the operator, in its order.
        goal: Goal of the hand where the skill acts.
        outwards: Unit vector from where the skill acts to where it begins.
        turned: Least and most angle by which the hand is turned, to either side, rad.

    Returns:
        A goal for the hand.
    """
    rng = np.random.default_rng(_seed(state, objects))
    angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(*ASIDE)
    right, up = _across(outwards)
    aside = far * (math.cos(angle) * np.array(right) + math.sin(angle) * np.array(up))
    x, y, z = (np.array(goal.position) + DISTANCE * np.array(outwards) + aside).tolist()
    turn = rng.choice((-1.0, 1.0)) * rng.uniform(*turned)
    return HandGoal((x, y, z), goal.yaw + turn)


def _as_it_is(state: State) -> HandGoal:
    """Where the hand is, turned as it is told."""
    _, yaw = hand_target(state)
    return HandGoal(hand_position(state), yaw)


def _is_relaxed(state: State) -> bool:
    target, _ = hand_target(state)
    return math.dist(target, hand_position(state)) <= RELAXED


def _seed(state: State, objects: tuple[Object, ...]) -> int:
    """A number that the state and the objects decide, the same in every process."""
    names = " ".join(obj.name for obj in objects)
    return int.from_bytes(hashlib.sha256(state.key + names.encode()).digest()[:8], "little")


def _across(axis: Vector) -> tuple[Vector, Vector]:
    """Two directions at right angles to an axis and to one another."""
    other = UP if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0)
    right = np.cross(axis, other)
    right /= np.linalg.norm(right)
    x, y, z = right.tolist()
    u, v, w = np.cross(right, axis).tolist()
    return (x, y, z), (u, v, w)
