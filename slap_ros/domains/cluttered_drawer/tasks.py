# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: tasks, sampled, and the reference's single start state. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations, product
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.cluttered_drawer import blocking
from slap_ros.domains.cluttered_drawer.blocking import SIDES, FingerClearance, blocking_relations
from slap_ros.domains.cluttered_drawer.features import BLOCK, TABLE, TARGET
from slap_ros.domains.cluttered_drawer.predicates import ON
from slap_ros.domains.cluttered_drawer.scene import BOTTOM, FIXED, HALF_WIDTH, MIDDLE, OPENING
from slap_ros.domains.tabletop.placements import GAP, free_placements
from slap_ros.domains.tabletop.presets import ARM_LIMITS, ArmSettings
from slap_ros.domains.tabletop.variation_limits import MATERIAL_LIMITS, REACH, TURN
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import body_features, pose_features
from slap_ros.worlds.joint_space.features import ROBOT, material_features, robot_features
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, CUBE_MATERIAL
from slap_ros.worlds.panda import HOME

STEP_LIMIT = 500  # environment steps (SLAP, appendix)
TRIES = 10_000  # arrangements drawn before there is said to be no room
NEIGHBOUR = 0.0675  # between the middles of the target block and of a blocker (reference)
APART = 0.15  # from the target block to a block that blocks no side of it
WALL_GAP = 0.04  # between a wall and a block's middle
ENDS = 0.06  # along y: of the drawer's two ends, where the blocks stand that block no side
SCATTERED = 4  # of those blocks at most stand anywhere there; more have no room but in rows
OFF_SPOT = 0.01  # from a block's spot in a row, along x and y, at most
SPOTS = tuple(product((-0.07, 0.07), (-0.31, -0.2, 0.2, 0.31)))  # x from the drawer's middle, y
PLACE_MARGIN = 0.07  # from walls to places for blockers, so that fingers can open there
PLACE_SPACING = 0.025  # of the grid of these places: the drawer is narrow
BLOCKING_LIMITS = {"reach": (0.0, OPENING), "half_width": (0.0, OPENING)}

Range = tuple[float, float]
PlanarPose = tuple[float, float, float]  # x, y, yaw in rad


@dataclass(frozen=True)
class DrawerArrangement:
    """Where the blocks stand, and what all of them are made of."""

    target: PlanarPose
    blockers: tuple[PlanarPose, ...]
    others: tuple[PlanarPose, ...] = ()
    material: Material = CUBE_MATERIAL

    def task(self) -> Task:
        """The task to put the target block on the table."""
        features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HOME)}
        for number, placed in enumerate((self.target, *self.blockers, *self.others), start=1):
            kind = TARGET if number == 1 else BLOCK
            features[kind(f"block{number}")] = _block(self.material, placed)
        for thing, (middle, half) in FIXED.items():
            features[thing] = {**pose_features(Pose(middle)), **_size(*half)}
        state = State.build(features)
        return Task(state, target_block_on_table(state), STEP_LIMIT)


def target_block_on_table(state: State) -> frozenset[GroundAtom]:
    """The goal: the target block stands on the table.

    Raises:
        InvalidStateError: The state has no target block or no table.
    """
    targets, tables = state.layout.of_type(TARGET), state.layout.of_type(TABLE)
    if not targets or not tables:
        raise InvalidStateError("a state of cluttered_drawer needs a target block and a table")
    return frozenset({ON(targets[0], tables[0])})


def _neighbour(
    target: PlanarPose, side: complex, distance: float, aside: float, turn: float
) -> PlanarPose:
    """A block beside another: at a side of it, at a distance, so far aside and so much turned."""
    x, y, yaw = target
    way = side * complex(distance, aside) * complex(math.cos(yaw), math.sin(yaw))
    return x + way.real, y + way.imag, yaw + turn


TOWARDS: tuple[complex, ...] = tuple(blocking.TOWARDS.tolist())


@dataclass(frozen=True)
class RandomDrawerTasks(ArmSettings):
    """Everything is sampled for each task. Lengths in m, angles in rad, masses in kg."""

    limits: ClassVar = (
        ARM_LIMITS
        | MATERIAL_LIMITS
        | BLOCKING_LIMITS
        | {
            "obstacles": (0, 20),
            "target_x": REACH,
            "target_y": REACH,
            "yaw": TURN,
            "distance": (0.0, OPENING),
            "aside": (0.0, OPENING),
            "turn": TURN,
        }
    )

    obstacles: tuple[int, int] = (4, 6)  # inclusive: up to four surround the target
    target_x: Range = (MIDDLE - 0.01, MIDDLE + 0.01)
    target_y: Range = (-0.04, 0.04)
    yaw: Range = (-0.35, 0.35)
    distance: Range = (NEIGHBOUR - 0.003, NEIGHBOUR + 0.007)
    aside: float = 0.008
    turn: float = 0.1
    # Of all blocks of a task alike.
    mass: Range = (CUBE_MATERIAL.mass_kg, CUBE_MATERIAL.mass_kg)
    friction: Range = (CUBE_MATERIAL.friction, CUBE_MATERIAL.friction)
    # What blocks: thresholds of the predicates, nothing that the tasks depend on.
    reach: float = FingerClearance.reach
    half_width: float = FingerClearance.half_width

    def sample(self, rng: np.random.Generator) -> Task:
        """A task in which every blocker blocks exactly one side.

        Raises:
            InvalidParameterError: There is no room for so many obstacles.
        """
        obstacles = int(rng.integers(self.obstacles[0], self.obstacles[1] + 1))
        for _ in range(TRIES):
            arrangement = self._draw(rng, obstacles)
            if arrangement is not None:
                return arrangement.task()
        raise InvalidParameterError(f"the drawer has no room for {obstacles} obstacles")

    def _draw(self, rng: np.random.Generator, obstacles: int) -> DrawerArrangement | None:
        """An arrangement; None where a block does not stand as it should."""
        x, y, yaw = (float(rng.uniform(*r)) for r in (self.target_x, self.target_y, self.yaw))
        target = (x, y, yaw)
        blocking_count = min(obstacles, len(SIDES))
        sides = sorted(rng.permutation(len(SIDES))[:blocking_count].tolist())
        blockers = tuple(
            _neighbour(
                target,
                TOWARDS[side],
                float(rng.uniform(*self.distance)),
                float(rng.uniform(-1, 1)) * self.aside,
                float(rng.uniform(-1, 1)) * self.turn,
            )
            for side in sides
        )
        count = obstacles - blocking_count
        others = self._scattered(rng, count) if count <= SCATTERED else self._in_rows(rng, count)
        if others is None:
            return None
        # Last, so that where things stand does not depend on it.
        material = Material(float(rng.uniform(*self.mass)), float(rng.uniform(*self.friction)))
        arrangement = DrawerArrangement(target, blockers, others, material)
        stands = _blocked_sides(arrangement) == [[side] for side in sides]
        fits = count <= SCATTERED or _has_room_for_two(arrangement)
        return arrangement if stands and fits else None

    def _scattered(self, rng: np.random.Generator, count: int) -> tuple[PlanarPose, ...] | None:
        """Blocks anywhere at the drawer's ends; None where two stand too close together."""
        others: list[PlanarPose] = []
        for _ in range(count):
            other = (
                MIDDLE + float(rng.uniform(-1, 1)) * (OPENING / 2 - WALL_GAP),
                float(rng.choice([-1, 1]) * (HALF_WIDTH - WALL_GAP - rng.uniform(0, ENDS))),
                float(rng.uniform(*self.yaw)),
            )
            if any(_between(other, thing) < GAP for thing in others):
                return None
            others.append(other)
        return tuple(others)

    def _in_rows(self, rng: np.random.Generator, count: int) -> tuple[PlanarPose, ...] | None:
        """Blocks in rows across the drawer's ends; None where two stand too close together."""
        if count > len(SPOTS):
            return None
        spots = rng.permutation(len(SPOTS))[:count].tolist()
        others = tuple(
            (
                MIDDLE + SPOTS[spot][0] + float(rng.uniform(-1, 1)) * OFF_SPOT,
                SPOTS[spot][1] + float(rng.uniform(-1, 1)) * OFF_SPOT,
                float(rng.uniform(*self.yaw)),
            )
            for spot in spots
        )
        crowded = any(_between(one, other) < GAP for one, other in combinations(others, 2))
        return None if crowded else others


@dataclass(frozen=True)
class PaperDrawerTasks(ArmSettings):
    """The single start state of the reference."""

    limits: ClassVar = ARM_LIMITS | BLOCKING_LIMITS

    # In the configuration that bags record, arrangements go by this name.
    scenery: DrawerArrangement = field(
        default_factory=lambda: DrawerArrangement(
            target=(MIDDLE, 0.0, 0.0),
            blockers=tuple(
                _neighbour((MIDDLE, 0.0, 0.0), side, NEIGHBOUR, 0.0, 0.0) for side in TOWARDS
            ),
        )
    )
    reach: float = FingerClearance.reach
    half_width: float = FingerClearance.half_width
    timing: str = "tens"
    shortcut_speed: float = 1 / 3

    def sample(self, _: np.random.Generator) -> Task:
        """The task of the single start state."""
        return self.scenery.task()


def _has_room_for_two(arrangement: DrawerArrangement) -> bool:
    """Whether two blockers can be put elsewhere in the drawer, as its skills do."""
    taken = [((x, y), GAP) for x, y, _ in (*arrangement.blockers, *arrangement.others)]
    x, y, _ = arrangement.target
    places = free_placements(
        (x, y),
        (MIDDLE, 0.0),
        (OPENING / 2 - PLACE_MARGIN, HALF_WIDTH - PLACE_MARGIN),
        [*taken, ((x, y), APART)],
        PLACE_SPACING,
    )
    return any(math.dist(one, other) >= GAP for one, other in combinations(places, 2))


def _between(one: PlanarPose, other: PlanarPose) -> float:
    return math.hypot(one[0] - other[0], one[1] - other[1])


def _blocked_sides(arrangement: DrawerArrangement) -> list[list[int]]:
    """The sides of the target block that each blocker blocks."""
    relations = blocking_relations(FingerClearance(), arrangement.task().initial_state)
    blocks = relations.blocking[:, 1 : 1 + len(arrangement.blockers)] >= 0.0
    return [np.flatnonzero(sides).tolist() for sides in blocks.T]


def _block(material: Material, placed: PlanarPose) -> Mapping[str, float]:
    x, y, yaw = placed
    half = CUBE_EDGE / 2
    return {
        **body_features((x, y, BOTTOM + half), from_yaw(yaw)),
        **material_features(material),
        **_size(half, half, half),
    }


def _size(x: float, y: float, z: float) -> Mapping[str, float]:
    return {"half_x": x, "half_y": y, "half_z": z}
