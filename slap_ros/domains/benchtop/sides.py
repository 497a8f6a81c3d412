# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways of going near an object: 0.04 m before it, from above and from each of four sides.

LG-SAIL's transition primitive without an operator: it says where a contact begins, and not what is
done there. The hand goes up to where nothing is in the way, over, and down, as it is: with its yaw,
its fingers, and what it holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from slap_ros.core import SideApproach, Sides
from slap_ros.domains.benchtop.approach import DISTANCE, UP
from slap_ros.domains.benchtop.hand_motion import HandGoal
from slap_ros.domains.benchtop.learner_interface import grips
from slap_ros.domains.benchtop.predicates import LIFTED
from slap_ros.domains.benchtop.scripts import BELOW_GRASP, Move, follow, over
from slap_ros.domains.benchtop.state_access import (
    hand_position,
    hand_target,
    held_thing,
    value,
    yaw_of,
)
from slap_ros.geometry.pose import Vector, conjugate, rotate
from slap_ros.relational import Column, Object, State
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.world import ACTION_SPACE, MAX_SHIFT
from slap_ros.worlds.features import pose_of

ABOVE = "above"
# rad, from an object's own x axis to each of its sides
TURNS = {side: k * 0.5 * math.pi for k, side in enumerate(("+x", "+y", "-x", "-y"))}

# What is held pushes with its middle where it can: higher up, it tilts in the hand.
SPARE = 0.002  # m, over the height from which on a thing is held


def make_sides(scene_of: Callable[[State], ContactScene]) -> Sides:
    """The approaches of a domain's objects: from above, then from each of an object's four sides.

    They end before a thing's surface, and before the point of anything else where the hand acts on
    it. What is in the hand is not approached.

    Args:
        scene_of: Function from a state to its bodies.
    """

    def sides(state: State, obj: Object) -> tuple[SideApproach, ...]:
        if obj is held_thing(state):
            return ()
        body = next((body for body in scene_of(state).free if body.name == obj.name), None)
        yaw, own = yaw_of(state, obj), conjugate(pose_of(state, obj).quaternion)
        level = {
            side: (math.cos(yaw + turn), math.sin(yaw + turn), 0.0) for side, turn in TURNS.items()
        }
        found = []
        for side, outwards in {ABOVE: UP, **level}.items():
            extent = 0.0 if body is None else body.extent(rotate(own, outwards))
            found.append(_side(state, obj, side, outwards, extent + DISTANCE))
        return tuple(found)

    return sides


def _side(state: State, obj: Object, side: str, outwards: Vector, away: float) -> SideApproach:
    point = grips(state.alone(), Column.of(obj))[0, 0]
    x, y, z = (point + away * np.array(outwards)).tolist()
    _, yaw = hand_target(state)
    goal = HandGoal((x, y, max(z, _lowest(state))), yaw)
    onwards = np.zeros(len(ACTION_SPACE.axes))  # it does not turn, and the gripper stays as it is
    onwards[:3] = -MAX_SHIFT * np.array(outwards) / np.abs(outwards).max()
    return SideApproach(follow(*over(state, goal), Move(goal)), onwards, side)


def _lowest(state: State) -> float:
    """The least height of the grasp point at which what is held still counts as held."""
    held = held_thing(state)
    if held is None:
        return BELOW_GRASP
    underside = value(state, held, "z") - value(state, held, "rest_height")
    return hand_position(state)[2] - underside + LIFTED + SPARE
