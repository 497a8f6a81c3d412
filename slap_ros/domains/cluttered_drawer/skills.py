# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: the given skills. Reach over a block, take it, put it elsewhere."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from slap_ros.core import Skill
from slap_ros.domains.cluttered_drawer.blocking import SIDES
from slap_ros.domains.cluttered_drawer.features import BLOCK, DRAWER, TABLE, TARGET, WALL
from slap_ros.domains.cluttered_drawer.tasks import APART, PLACE_MARGIN, PLACE_SPACING
from slap_ros.domains.tabletop.grasps import (
    PutDown,
    from_above,
    grasps_to_stand,
    quarter_turns,
    ways_to_put_down,
)
from slap_ros.domains.tabletop.memory import memoized
from slap_ros.domains.tabletop.placements import GAP, free_placements
from slap_ros.domains.tabletop.planning_scene import PlanningScene
from slap_ros.domains.tabletop.skills import GRIP, RELEASE, ReachSkill, Transits, TransitSkill
from slap_ros.domains.tabletop.state_access import box_of, held_body, yaw_of
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.domains.tabletop.transit import Transit
from slap_ros.errors import SkillNotApplicableError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_of

LIFT = 0.02  # m, of a block that counts as picked; it still blocks what it blocked
TABLE_MARGIN = 0.05  # m, of places on the table from its edges

# Turns of the hand against the target block: its fingers move along the hand's y.
LEFT_RIGHT, FRONT_BACK = (0.0, math.pi), (math.pi / 2, -math.pi / 2)
ANY = (*LEFT_RIGHT, *FRONT_BACK)
DIAGONALLY = tuple(turn + math.pi / 4 for turn in ANY)


def _solid(state: State) -> Iterator[tuple[Object, OrientedBox]]:
    """Blocks, the table, and all of the drawer."""
    for kind in (BLOCK, TABLE, DRAWER, WALL):
        for thing in state.layout.of_type(kind):
            yield thing, box_of(state, thing)


PLANNING_SCENE = PlanningScene(
    _solid, lambda state, body: OrientedBox(IDENTITY, box_of(state, body).half)
)


def _least_turned(yaw: float) -> float:
    """The same up to quarter turns, as sides are named: from -45 to 45 degrees, rad."""
    return yaw - round(yaw / (math.pi / 2)) * math.pi / 2


@memoized
def _transit_to_grasp(state: State, block: Object, turns: Sequence[float]) -> Transit:
    pose = pose_of(state, block)
    yaw = _least_turned(yaw_of(pose))
    grasps = [from_above(pose.position, yaw + turn) for turn in turns]
    return Transit(PLANNING_SCENE, state, grasps, touched=(block,))


def _to_block(turns: Sequence[float]) -> Transits:
    """To a grasp of the block, the hand turned so against it."""

    def transits(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
        yield _transit_to_grasp(state, objects[1], turns)

    return transits


def _over_block(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    """Over a grasp of the block; between other blocks, the fingers over the gaps at its edges."""
    for turns in (ANY, DIAGONALLY):
        yield _transit_to_grasp(state, objects[1], turns)


@memoized
def _transit_to_placement(
    state: State, place: tuple[float, float], surface: Object, how: PutDown
) -> Transit:
    """The transit after which the held block stands on a surface at a place, turned as it is."""
    block = held_body(state)
    if block is None:
        raise SkillNotApplicableError("nothing is held")
    top, yaws = box_of(state, surface).top, quarter_turns(yaw_of(pose_of(state, block)))
    goals = grasps_to_stand(state, box_of(state, block), place, top, yaws, how)
    return Transit(PLANNING_SCENE, state, goals, touched=(surface,))


def _onto_surface(state: State, block: Object, surface: Object, margin: float) -> Iterator[Transit]:
    """To free places away from all sides of the target block, nearest to the held one first."""
    board, near = box_of(state, surface), pose_of(state, block).position[:2]
    taken = [
        (pose_of(state, other).position[:2], APART if other.type.is_a(TARGET) else GAP)
        for other in state.layout.of_type(BLOCK)
        if other != block
    ]
    half_x, half_y, _ = board.half
    halves = (half_x - margin, half_y - margin)
    for place in free_placements(near, board.pose.position[:2], halves, taken, PLACE_SPACING):
        for how in ways_to_put_down(state):
            yield _transit_to_placement(state, place, surface, how)


def _into_drawer(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    _, block, _, drawer = objects
    return _onto_surface(state, block, drawer, PLACE_MARGIN)


def _onto_table(state: State, objects: tuple[Object, ...]) -> Iterator[Transit]:
    _, block, table = objects
    return _onto_surface(state, block, table, TABLE_MARGIN)


def skills(timing: Timing) -> dict[str, Skill]:
    """A skill for each operator."""

    def grasp(name: str, turns: Sequence[float]) -> Skill:
        return TransitSkill(name, timing, _to_block(turns), GRIP, LIFT)

    made = [
        ReachSkill("Reach", timing, _over_block),
        grasp("GraspFrontBack", FRONT_BACK),
        grasp("GraspLeftRight", LEFT_RIGHT),
        grasp("GraspFullClear", ANY),
        grasp("GraspNonTarget", ANY),
        TransitSkill("PlaceTarget", timing, _onto_table, RELEASE),
        *(TransitSkill(f"Place{side}Block", timing, _into_drawer, RELEASE) for side in SIDES),
    ]
    return {skill.name: skill for skill in made}
