# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make Coffee: where skills act, and scripts that do what the operators say. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping

from slap_ros.core import Policy, Script
from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.approach import (
    UP,
    acted_on,
    carried,
    make_approach,
    relax_and_withdraw,
)
from slap_ros.domains.benchtop.cabinet import CABINET
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, GoalOf, HandGoal
from slap_ros.domains.benchtop.scripts import (
    BELOW_GRASP,
    GENTLE,
    Move,
    follow,
    grasp,
    over,
    release,
)
from slap_ros.domains.benchtop.state_access import (
    axis_of,
    hand_position,
    position_of,
    standing_on,
    value,
    yaw_of,
)
from slap_ros.domains.make_coffee.scenery import HINGE, HOLDER, POD, RIM, lid_pose
from slap_ros.geometry.pose import Vector
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of

TRAVEL_HEIGHT = 0.23  # of the grasp point, which then passes over an open lid
LIFT = 0.1  # of a pod that was picked
PRESS = 0.001  # over the bottom of the holder, where a pod is let go
# Height of the grasp point at which fingers are over the rim of the holder. Fingers that lean on it
# do not open, and a hand that slips on a pod, as a Panda's does, would come so deep.
OVER_RIM = RIM + BELOW_GRASP
# Where fingers touch the back of an open lid, in its frame, and how far they are from it then. Near
# its edge: further down, random motions turn it over in a tenth of the episodes and more.
BACK: Vector = (-0.1, 0.0, 0.015)
AWAY = 0.035  # more, before they push
# Where the hand goes to turn a lid down, from its hinge: over the hinge, then down on the lid.
PUSHES = ((0.0, 0.085), (-0.05, 0.07), (-0.07, 0.03), (-0.07, 0.004))  # x and z, m
PUSH = 0.01  # in a control step
SHUT = 0.05  # rad, at which the lid is let go


def acts_at(state: State, objects: tuple[Object, ...]) -> HandGoal:
    """Where a skill acts: a handle, a pod, the back of a lid; or where a held pod is inserted."""
    pod, there = carried(state, objects), acted_on(state, objects)
    if pod is not None:
        return inserting(pod, there)(state)
    if there.type.is_a(POD):
        return at_pod(state, there)
    if there.type.is_a(HOLDER):
        return at_lid(state, there)
    return drawers.at_handle(state, there)


def outwards(state: State, objects: tuple[Object, ...]) -> Vector:
    """A skill begins above where it acts, but CloseLid behind it."""
    there = acted_on(state, objects)
    behind = carried(state, objects) is None and there.type.is_a(HOLDER)
    return axis_of(state, there) if behind else UP


# Between the walls of holder and drawer the hand is pressed against them.
APPROACH = make_approach(acts_at, outwards, lambda _: TRAVEL_HEIGHT, leave=relax_and_withdraw)


def at_pod(state: State, pod: Object) -> HandGoal:
    """Where the hand grasps a pod, with its palm along the front of the cabinet."""
    (cabinet,) = state.layout.of_type(CABINET)
    return HandGoal(position_of(state, pod), yaw_of(state, cabinet) - 0.5 * math.pi)


def at_lid(state: State, holder: Object, away: float = 0.0) -> HandGoal:
    """Where fingers touch the back of an open lid, or a place behind it.

    Args:
        state: Current state.
        holder: Holder that has the lid.
        away: Distance of the place behind the lid, along the holder's x, m.

    Returns:
        A goal for the hand.
    """
    lid = lid_pose(pose_of(state, holder), value(state, holder, "opening"))
    x, y, z = lid.apply(BACK)
    ahead, aside, _ = axis_of(state, holder)
    return HandGoal((x + away * ahead, y + away * aside, z), yaw_of(state, holder))


def inserting(pod: Object, holder: Object, height: float = 0.0) -> GoalOf:
    """Where the hand must be for the pod in it to be in the holder.

    Args:
        pod: Pod in the hand.
        holder: Holder that the pod goes into.
        height: Height of the pod over its place in the holder, m.
    """

    def goal(state: State) -> HandGoal:
        place, at = standing_on(state, pod, holder), position_of(state, pod)
        x, y, z = (h + p - o for h, p, o in zip(hand_position(state), place, at, strict=True))
        return HandGoal((x, y, z + height), yaw_of(state, holder))

    return goal


def letting_go(pod: Object, holder: Object) -> GoalOf:
    """Where the hand lets a pod go: just over its place, but with the fingers over the rim.

    Args:
        pod: Pod in the hand.
        holder: Holder that the pod goes into.
    """
    inserted = inserting(pod, holder, PRESS)

    def goal(state: State) -> HandGoal:
        there, (*_, table) = inserted(state), position_of(state, holder)
        *_, z = there.position
        return there.at_height(max(z, table + OVER_RIM))

    return goal


def pushing(holder: Object, ahead: float, up: float) -> GoalOf:
    """A place for the hand, seen from the hinge.

    Args:
        holder: Holder whose lid is pushed.
        ahead: Distance of the place from the hinge along the holder's x, m.
        up: Height of the place over the hinge, m.
    """
    x, y, z = HINGE

    def goal(state: State) -> HandGoal:
        at = pose_of(state, holder).apply((x + ahead, y, z + up))
        return HandGoal(at, yaw_of(state, holder))

    return goal


def pick(state: State, objects: tuple[Object, ...]) -> Policy:
    """Grasp a pod in its middle and lift it out."""
    *_, pod = objects
    goal = at_pod(state, pod)
    return follow(
        release(),
        *over(state, goal, OPEN, TRAVEL_HEIGHT),
        Move(lambda now: at_pod(now, pod), OPEN),
        *grasp(pod),
        Move(goal.raised(LIFT), CLOSE),
    )


def insert(state: State, objects: tuple[Object, ...]) -> Policy:
    """Put a pod into a holder, and let it go."""
    pod, holder = objects
    return follow(
        *over(state, inserting(pod, holder)(state), CLOSE, TRAVEL_HEIGHT),
        Move(letting_go(pod, holder), CLOSE, fastest=GENTLE),
        release(),
    )


def close_lid(state: State, objects: tuple[Object, ...]) -> Policy:
    """Turn a lid down from behind, and press on it."""
    (holder,) = objects
    behind = at_lid(state, holder, AWAY)
    return follow(
        release(),
        *over(state, behind, CLOSE, TRAVEL_HEIGHT),
        Move(behind, CLOSE),
        *(_push(holder, pushing(holder, ahead, up)) for ahead, up in PUSHES),
    )


def _push(holder: Object, goal: GoalOf) -> Move:
    """Push towards a place until the hand is there or the lid is closed."""

    def done(state: State) -> bool:
        return value(state, holder, "opening") <= SHUT or goal(state).reached(state)

    return Move(goal, CLOSE, done, PUSH, patience=20)


SCRIPTS: Mapping[str, Script] = {
    **drawers.SCRIPTS,
    "Pick": pick,
    "Insert": insert,
    "CloseLid": close_lid,
}
