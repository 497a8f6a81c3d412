# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: where skills begin, and scripts that pick and insert. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping

from slap_ros.core import Policy, Script
from slap_ros.domains.benchtop.approach import UP, acted_on, carried, make_approach
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, GoalOf, HandGoal
from slap_ros.domains.benchtop.scripts import Move, follow, grasp, over, release
from slap_ros.domains.benchtop.state_access import axis_of, hand_position, hand_yaw, position_of
from slap_ros.domains.peg_in_hole.model import INSERT, PICK
from slap_ros.domains.peg_in_hole.scenery import FACE, PEG_LENGTH, PEG_RADIUS
from slap_ros.geometry.pose import Vector, from_yaw, rotate
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of

BEHIND = 0.03  # the middle of a peg, it is grasped: so the fingers stay out of the plate's way
LIFT = 0.05  # of a peg that was picked
IN_FRONT = 0.015  # of the plate's face, where the tip is aligned
ALIGNED, ALIGNED_TURN = 0.001, 0.02  # m, rad; from the hole's axis
SEATED = 0.003  # from the seat, along the hole's axis
PUSH = 0.008  # in a step, at most, into the hole
NEAR = 0.06  # from before the hole: nearer than this, there is no need to go up


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a peg behind its middle, and lift it."""
    (peg,) = objects
    return follow(
        release(),
        *over(state, grasping(state, peg), OPEN),
        Move(lambda now: grasping(now, peg), OPEN),
        *grasp(peg),
        Move(grasping(state, peg).raised(LIFT), CLOSE),
    )


def insert(state: State, objects: tuple[Object, ...]) -> Policy:
    """Bring a held peg's tip before a hole, align it, push it in, and let it go."""
    peg, hole = objects

    def tip_at(ahead: float) -> GoalOf:
        return lambda now: inserting(now, peg, hole, ahead)

    def aligned(now: State) -> bool:
        x, y, z = tip_seen_from(now, peg, hole)
        in_line = math.hypot(y, z) < ALIGNED and abs(turn_between(now, peg, hole)) < ALIGNED_TURN
        return in_line and abs(x - FACE + IN_FRONT) < IN_FRONT

    def seated(now: State) -> bool:
        return tip_seen_from(now, peg, hole)[0] > 0.5 * PEG_LENGTH - SEATED

    before = inserting(state, peg, hole, FACE - IN_FRONT)
    return follow(
        *(() if before.distance(state) < NEAR else over(state, before, CLOSE)),
        Move(tip_at(FACE - IN_FRONT), CLOSE, aligned),
        Move(tip_at(0.5 * PEG_LENGTH), CLOSE, seated, fastest=PUSH),
        release(),
    )


def grasping(state: State, peg: Object) -> HandGoal:
    """Where the hand grasps a peg that lies."""
    ahead_x, ahead_y, _ = leading(state, peg)
    x, y, _ = position_of(state, peg)
    at = (x - BEHIND * ahead_x, y - BEHIND * ahead_y, PEG_RADIUS)
    return HandGoal(at, math.atan2(ahead_y, ahead_x))


def inserting(state: State, peg: Object, hole: Object, ahead: float) -> HandGoal:
    """Where the hand has the tip of what it holds on a hole's axis, and the peg along it.

    Args:
        state: Current state.
        peg: Peg in the hand.
        hole: Hole whose axis the tip is to be on.
        ahead: Distance of the tip from the seat, along the hole's x, m.
    """
    turn = turn_between(state, peg, hole)
    hand, tip = hand_position(state), tip_of(state, peg)
    to_tip: Vector = (tip[0] - hand[0], tip[1] - hand[1], tip[2] - hand[2])
    turned = rotate(from_yaw(-turn), to_tip)
    wanted = pose_of(state, hole).apply((ahead, 0.0, 0.0))
    x, y, z = (w - t for w, t in zip(wanted, turned, strict=True))
    return HandGoal((x, y, z), hand_yaw(state) - turn)


def leading(state: State, peg: Object) -> Vector:
    """The direction of a peg's axis that points away from the arm."""
    x, y, z = axis_of(state, peg)
    return (x, y, z) if x > 0.0 else (-x, -y, -z)


def tip_of(state: State, peg: Object) -> Vector:
    """The end of a peg that is further away from the arm."""
    x, y, z = (
        p + 0.5 * PEG_LENGTH * a
        for p, a in zip(position_of(state, peg), leading(state, peg), strict=True)
    )
    return (x, y, z)


def tip_seen_from(state: State, peg: Object, hole: Object) -> Vector:
    """The position of a peg's tip in a hole's frame.

    Args:
        state: A single state.
        peg: Peg that has the tip.
        hole: Hole that has the frame.
    """
    return pose_of(state, hole).inverse().apply(tip_of(state, peg))


def turn_between(state: State, peg: Object, hole: Object) -> float:
    """How a peg is turned about the vertical, seen from a hole, rad.

    Args:
        state: A single state.
        peg: Peg whose turn is measured.
        hole: Hole whose frame the turn is measured in.
    """
    back = pose_of(state, hole).inverse().quaternion
    x, y, _ = rotate(back, leading(state, peg))
    return math.atan2(y, x)


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Where the hand grasps a peg, or has the tip of the one that it holds at a hole's mouth."""
    peg, other = carried(state, objects), acted_on(state, objects)
    return grasping(state, other) if peg is None else inserting(state, peg, other, FACE)


def outwards(state: State, objects: tuple[Object, ...]) -> Vector:
    """From a hole against its axis; from a peg upwards."""
    if carried(state, objects) is None:
        return UP
    x, y, z = axis_of(state, acted_on(state, objects))
    return (-x, -y, -z)


APPROACH = make_approach(acts_at, outwards)
SCRIPTS: Mapping[str, Script] = {PICK.name: pick, INSERT.name: insert}
