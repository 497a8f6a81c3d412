# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: the given skills. Depart upwards, cross on a planned path, come down, grip.

Grasps are from above, fingers along the faces of the block. Where a skill ends, the next begins:
with the fingers still around a block that was let go, or a block just lifted off.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import combinations

from slap_ros.core import Skill
from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.domains.tabletop.grasps import (
    PutDown,
    grasps_along_faces,
    grasps_to_stand,
    quarter_turns,
    ways_to_put_down,
)
from slap_ros.domains.tabletop.memory import memoized
from slap_ros.domains.tabletop.placements import GAP, Placement, free_placements
from slap_ros.domains.tabletop.planning_scene import PlanningScene
from slap_ros.domains.tabletop.skills import GRIP, RELEASE, TRAVEL, TransitSkill
from slap_ros.domains.tabletop.state_access import box_of, held_body, yaw_of
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.domains.tabletop.transit import Transit
from slap_ros.errors import SkillNotApplicableError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of

LIFT = 0.02  # m, of a block that counts as picked; the fingers go as far in a control step
TABLE_MARGIN = 0.05  # m, of places on the table from its edges
ONE_OVER_ANOTHER = GAP - TRAVEL  # m, between middles seen from above, at most


def _solid(state: State) -> Iterator[tuple[Object, OrientedBox]]:
    """Blocks and the table; targets are flush with it."""
    for thing in (*state.layout.of_type(BLOCK), *state.layout.of_type(SURFACE)):
        if state.get(thing, "is_target") < 0.5:
            yield thing, box_of(state, thing)


PLANNING_SCENE = PlanningScene(
    _solid, lambda state, body: OrientedBox(IDENTITY, box_of(state, body).half)
)


@memoized
def _transit_to_grasp(state: State, block: Object) -> Transit:
    return Transit(
        PLANNING_SCENE, state, grasps_along_faces(pose_of(state, block)), touched=(block,)
    )


@memoized
def _transit_to_placement(
    state: State, place: Placement, yaw: float, thing: Object, how: PutDown
) -> Transit:
    """The transit after which the held block stands on a thing at a place."""
    block = held_body(state)
    if block is None:
        raise SkillNotApplicableError("nothing is held")
    top = box_of(state, thing).top
    yaws = quarter_turns(yaw)
    goals = grasps_to_stand(state, box_of(state, block), place, top, yaws, how)
    # Fingers that reach below a levelled block stay just over the table, around a target as well.
    touched = state.layout.of_type(SURFACE) if how is PutDown.LEVELLED else ()
    return Transit(PLANNING_SCENE, state, goals, touched=(thing, *touched))


def _to_block(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    """To a grasp of the block."""
    _, block, _ = objects
    yield _transit_to_grasp(state, block)


def _onto_middle(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    """Onto the middle of the target or of another block."""
    _, _, thing = objects
    x, y, _ = pose_of(state, thing).position
    yaw = yaw_of(pose_of(state, thing))
    for how in ways_to_put_down(state):
        yield _transit_to_placement(state, (x, y), yaw, thing, how)


def _onto_table(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    """To free places on the table, nearest to the block first."""
    _, block, table = objects
    yaw = yaw_of(pose_of(state, block))
    for place in _places(state, block, table):
        for how in ways_to_put_down(state):
            yield _transit_to_placement(state, place, yaw, table, how)


@memoized
def _places(state: State, block: Object, table: Object) -> list[Placement]:
    """The free places on the table, nearest to the block first."""
    board = box_of(state, table)
    others = [b for b in state.layout.of_type(BLOCK) if b != block]
    others += [s for s in state.layout.of_type(SURFACE) if s != table]
    taken = [(pose_of(state, thing).position[:2], GAP) for thing in others]
    half_x, half_y, _ = board.half
    margins = half_x - TABLE_MARGIN, half_y - TABLE_MARGIN
    near, middle = pose_of(state, block).position[:2], board.pose.position[:2]
    return free_placements(near, middle, margins, taken)


@memoized
def stand_apart(state: State) -> bool:
    """Whether blocks and targets stand one over another, or so far apart that the hand travels.

    Places on the table are GAP away from all that stands there. So a hand that picks up another
    block than it has put down, or puts one down elsewhere, goes TRAVEL at least.
    """
    held = held_body(state)
    things = [b for b in state.layout.of_type(BLOCK) if b != held]
    things += [s for s in state.layout.of_type(SURFACE) if state.get(s, "is_target") > 0.5]
    places = [pose_of(state, thing).position[:2] for thing in things]
    distances = (math.dist(*pair) for pair in combinations(places, 2))
    return all(one <= ONE_OVER_ANOTHER or one >= TRAVEL for one in distances)


def skills(timing: Timing) -> dict[str, Skill]:
    """A skill for each operator."""
    pick = partial(TransitSkill, timing=timing, gripper=GRIP, lift=LIFT, travels=stand_apart)
    place = partial(TransitSkill, timing=timing, gripper=RELEASE, travels=stand_apart)
    return {
        "Pick": pick("Pick", transits=_to_block),
        "PickFromTarget": pick("PickFromTarget", transits=_to_block),
        "Unstack": pick("Unstack", transits=_to_block),
        "Place": place("Place", transits=_onto_table),
        "PlaceInTarget": place("PlaceInTarget", transits=_onto_middle),
        "Stack": place("Stack", transits=_onto_middle),
    }
