# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: tasks, sampled, and the reference's single start state. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.obstacle_tower.features import BLOCK, SURFACE
from slap_ros.domains.obstacle_tower.predicates import NOT_IS_TARGET, ON
from slap_ros.domains.tabletop.placements import GAP
from slap_ros.domains.tabletop.presets import ARM_LIMITS, ArmSettings
from slap_ros.domains.tabletop.variation_limits import MATERIAL_LIMITS, REACH, TURN
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.pose import Pose, from_yaw
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import body_features, pose_features
from slap_ros.worlds.joint_space.features import ROBOT, material_features, robot_features
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, CUBE_MATERIAL, TABLE, TABLE_TOP
from slap_ros.worlds.panda import HOME

STEP_LIMIT = 500  # environment steps (SLAP, appendix)
TRIES = 10_000  # places drawn before there is said to be no room
PLATE_HALF = (0.026, 0.026, 0.0005)  # the target: a plate for one block, flush with the table

Range = tuple[float, float]


@dataclass(frozen=True)
class TowerArrangement:
    """Where everything stands, yaws in rad; and what all blocks are made of."""

    target: tuple[float, float, float]  # x, y, yaw
    target_block: tuple[float, float, float]
    tower: tuple[tuple[float, float, float], ...]  # from the bottom; the first is on the target
    distractors: tuple[tuple[float, float, float], ...] = ()
    material: Material = CUBE_MATERIAL

    def task(self) -> Task:
        """The task to put the target block on the target."""
        features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HOME)}
        features[BLOCK("block1")] = _block(self.material, *self.target_block)
        others = [(*place, level) for level, place in enumerate(self.tower)]
        others += [(*place, 0) for place in self.distractors]
        for number, place in enumerate(others, start=2):
            features[BLOCK(f"block{number}")] = _block(self.material, *place)
        x, y, yaw = self.target
        plate = Pose((x, y, TABLE_TOP - PLATE_HALF[2]), from_yaw(yaw))
        features[SURFACE("target")] = _surface(plate, PLATE_HALF, is_target=1.0)
        features[SURFACE("table")] = _surface(TABLE.pose, TABLE.half_extents_m, is_target=0.0)
        state = State.build(features)
        return Task(state, target_block_on_target(state), STEP_LIMIT)


def target_block_on_target(state: State) -> frozenset[GroundAtom]:
    """The goal: the first block, which is the target block, stands on the target.

    Raises:
        InvalidStateError: The state has no block or no target.
    """
    blocks = state.layout.of_type(BLOCK)
    targets = [s for s in state.layout.of_type(SURFACE) if not NOT_IS_TARGET(s).holds(state)]
    if not blocks or not targets:
        raise InvalidStateError("a state of obstacle_tower needs a block and a target")
    return frozenset({ON(blocks[0], targets[0])})


@dataclass(frozen=True)
class RandomTowerTasks(ArmSettings):
    """Everything is sampled for each task. Lengths in m, angles in rad, masses in kg."""

    limits: ClassVar = (
        ARM_LIMITS
        | MATERIAL_LIMITS
        | {
            "obstacles": (0, 20),
            "distractors": (0, 20),
            "target_x": REACH,
            "target_y": REACH,
            "yaw": TURN,
            "block_x": REACH,
            "block_y": REACH,
            "stacking_offset": (0.0, CUBE_EDGE),
            "stacking_turn": TURN,
        }
    )

    obstacles: tuple[int, int] = (3, 3)  # blocks of the tower, inclusive
    distractors: tuple[int, int] = (0, 2)  # blocks that stand about besides, inclusive
    target_x: Range = (0.45, 0.55)
    target_y: Range = (-0.05, 0.05)
    yaw: Range = (-math.pi / 4, math.pi / 4)
    block_x: Range = (0.35, 0.65)
    block_y: Range = (-0.3, 0.3)
    stacking_offset: float = 0.003
    stacking_turn: float = 0.1
    # Of all blocks of a task alike.
    mass: Range = (CUBE_MATERIAL.mass_kg, CUBE_MATERIAL.mass_kg)
    friction: Range = (CUBE_MATERIAL.friction, CUBE_MATERIAL.friction)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with a tower on the target.

        Raises:
            InvalidParameterError: There is no room for so many distractors.
        """
        obstacles = int(rng.integers(self.obstacles[0], self.obstacles[1] + 1))
        distractors = int(rng.integers(self.distractors[0], self.distractors[1] + 1))
        target = tuple(rng.uniform(*r) for r in (self.target_x, self.target_y, self.yaw))
        x, y, yaw = target
        tower = tuple(
            (
                x + rng.uniform(-1, 1) * self.stacking_offset,
                y + rng.uniform(-1, 1) * self.stacking_offset,
                yaw + rng.uniform(-1, 1) * self.stacking_turn,
            )
            for _ in range(obstacles)
        )
        placed: list[tuple[float, float]] = [(x, y)]
        standing = tuple(self._stand_apart(rng, placed) for _ in range(1 + distractors))
        # Last, so that where things stand does not depend on it.
        material = Material(rng.uniform(*self.mass), rng.uniform(*self.friction))
        return TowerArrangement((x, y, yaw), standing[0], tower, standing[1:], material).task()

    def _stand_apart(
        self, rng: np.random.Generator, placed: list[tuple[float, float]]
    ) -> tuple[float, float, float]:
        """A place away from those already taken, which it joins.

        Raises:
            InvalidParameterError: There is no room for another block.
        """
        for _ in range(TRIES):
            x, y = rng.uniform(*self.block_x), rng.uniform(*self.block_y)
            if all(math.hypot(x - px, y - py) > 1.4 * GAP for px, py in placed):
                placed.append((x, y))
                return x, y, rng.uniform(*self.yaw)
        raise InvalidParameterError(
            f"the table has no room for {len(placed)} blocks that stand apart from the tower"
        )


@dataclass(frozen=True)
class PaperTowerTasks(ArmSettings):
    """The single start state of the reference."""

    arrangement: TowerArrangement = TowerArrangement(
        target=(0.5, 0.0, 0.0),
        target_block=(0.375, -0.2, 0.0),
        tower=((0.5, 0.0, 0.0),) * 3,
    )
    timing: str = "tens"

    def sample(self, _: np.random.Generator) -> Task:
        """The task of the single start state."""
        return self.arrangement.task()

    def as_configuration(self) -> Mapping[str, str]:
        """The settings and the arrangement's parts by name."""
        parts = asdict(self)
        parts |= parts.pop("arrangement")
        return {name: str(value) for name, value in parts.items()}


def _block(
    material: Material, x: float, y: float, yaw: float, level: int = 0
) -> Mapping[str, float]:
    z = TABLE_TOP + CUBE_EDGE * (level + 0.5)
    half = CUBE_EDGE / 2
    return {
        **body_features((x, y, z), from_yaw(yaw)),
        **material_features(material),
        **_thing((half, half, half), is_movable=1.0, is_target=0.0),
    }


def _surface(
    pose: Pose, half_extents: tuple[float, float, float], is_target: float
) -> Mapping[str, float]:
    return {**pose_features(pose), **_thing(half_extents, is_movable=0.0, is_target=is_target)}


def _thing(
    half_extents: tuple[float, float, float], is_movable: float, is_target: float
) -> Mapping[str, float]:
    half_x, half_y, half_z = half_extents
    return {
        "half_x": half_x,
        "half_y": half_y,
        "half_z": half_z,
        "is_movable": is_movable,
        "is_target": is_target,
    }
