# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movements of the hand that a learner gives parameters to (MAPLE: Nasiriany et al. 2022, §III).

Where to grasp, to put down and to push is for the learner to say. Each goes up to where nothing is
in the way, over, and down, in closed loop.
"""

from __future__ import annotations

import math

import numpy as np

from slap_ros.core import Policy, Primitives
from slap_ros.domains.benchtop.approach import acted_on
from slap_ros.domains.benchtop.hand_motion import CLOSE, OPEN, HandGoal
from slap_ros.domains.benchtop.scripts import (
    CLEARANCE,
    GENTLE,
    Move,
    close_around,
    follow,
    over,
    release,
)
from slap_ros.domains.benchtop.state_access import held_thing, position_of
from slap_ros.geometry.pose import Vector
from slap_ros.relational import Object, State
from slap_ros.relational.state import Array

# From what is acted on to the grasp point, m; the hand's yaw, rad; how far it pushes, m.
HIGH = np.array([0.1, 0.1, 0.1, 0.5 * math.pi, 0.15, 0.15, 0.15])
RISE_STEPS = 10  # environment steps at most, up from where something was let go


def reach(state: State, parameters: Array) -> Policy:
    """Go to a point, whatever is in the hand."""
    goal = _goal(parameters)
    return follow(*over(state, goal), Move(goal))


def grasp(state: State, parameters: Array) -> Policy:
    """Open the fingers, go to a point, close them, and lift."""
    goal = _goal(parameters)
    return follow(
        release(),
        *over(state, goal, OPEN),
        Move(goal, OPEN),
        *close_around(lambda now: held_thing(now) is not None),
        Move(goal.raised(CLEARANCE), CLOSE, patience=RISE_STEPS),
    )


def place(state: State, parameters: Array) -> Policy:
    """Go to a point with what is in the hand, slowly in the end, open the fingers, and rise."""
    goal = _goal(parameters)
    above = goal.raised(CLEARANCE)
    return follow(
        *over(state, above, CLOSE),
        Move(above, CLOSE),
        Move(goal, CLOSE, fastest=GENTLE),
        release(),
        Move(above, OPEN, patience=RISE_STEPS),
    )


def push(state: State, parameters: Array) -> Policy:
    """Go to a point with closed fingers, and from there straight on by a displacement.

    What is held is pulled along.
    """
    goal = _goal(parameters)
    x, y, z = (float(p + d) for p, d in zip(goal.position, parameters[4:7], strict=True))
    beyond = HandGoal((x, y, z), goal.yaw)
    return follow(*over(state, goal, CLOSE), Move(goal, CLOSE), Move(beyond, CLOSE))


def open_fingers(state: State, parameters: Array) -> Policy:
    """Open the fingers where the hand is."""
    del state, parameters
    return follow(release())


def _goal(parameters: Array) -> HandGoal:
    x, y, z, yaw = map(float, parameters[:4])
    return HandGoal((x, y, z), yaw)


def _target(state: State, objects: tuple[Object, ...]) -> Vector:
    """The position of what an operator acts on."""
    return position_of(state, acted_on(state, objects))


PRIMITIVES = Primitives(
    {"reach": reach, "grasp": grasp, "place": place, "push": push, "open": open_fingers},
    {"reach": 4, "grasp": 4, "place": 4, "push": 7, "open": 0},
    low=-HIGH,
    high=HIGH,
    target_of=_target,
)
