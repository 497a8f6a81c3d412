# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: tasks, sampled, and the reference's single start state. Lengths in m."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
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

STEP_LIMIT = 500  # environment steps for each tower (SLAP, appendix)
APART = 1.4 * GAP  # between a block that stands about and a tower or another block, at least
NEARER = 1.1 * GAP  # between such blocks on a table with several towers
BETWEEN_TOWERS = 0.2  # between the middles of targets at least
TRIES = 10_000  # places drawn for one thing
ARRANGEMENTS = 20  # drawn before there is said to be no room
PLATE_HALF = (0.026, 0.026, 0.0005)  # the target: a plate for one block, flush with the table

Range = tuple[float, float]
PlanarPose = tuple[float, float, float]  # x, y, yaw in rad


@dataclass(frozen=True)
class Tower:
    """A target, the tower that stands on it, and the block that is to stand there instead."""

    target: PlanarPose
    target_block: PlanarPose
    obstacles: tuple[PlanarPose, ...]  # from the bottom; the first is on the target


@dataclass(frozen=True)
class TowerArrangement:
    """Where everything stands with one tower; and what all blocks are made of."""

    target: PlanarPose
    target_block: PlanarPose
    tower: tuple[PlanarPose, ...]  # from the bottom; the first is on the target
    distractors: tuple[PlanarPose, ...] = ()
    material: Material = CUBE_MATERIAL

    def task(self) -> Task:
        """The task to put the target block on the target."""
        tower = Tower(self.target, self.target_block, self.tower)
        return make_task((tower,), self.distractors, self.material)


def make_task(
    towers: Sequence[Tower], distractors: Sequence[PlanarPose], material: Material
) -> Task:
    """The task to put each target block on its target.

    Args:
        towers: Towers with their targets and target blocks.
        distractors: Places of the blocks that stand about besides.
        material: Material of all blocks.

    Returns:
        A task with blocks in this order: target blocks, towers from the bottom, distractors.
    """
    blocks = [(*tower.target_block, 0) for tower in towers]
    for tower in towers:
        blocks += [(*place, level) for level, place in enumerate(tower.obstacles)]
    blocks += [(*place, 0) for place in distractors]
    features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HOME)}
    for number, place in enumerate(blocks, start=1):
        features[BLOCK(f"block{number}")] = _block(material, *place)
    for number, tower in enumerate(towers, start=1):
        x, y, yaw = tower.target
        plate = Pose((x, y, TABLE_TOP - PLATE_HALF[2]), from_yaw(yaw))
        name = "target" if number == 1 else f"target{number}"
        features[SURFACE(name)] = _surface(plate, PLATE_HALF, is_target=1.0)
    features[SURFACE("table")] = _surface(TABLE.pose, TABLE.half_extents_m, is_target=0.0)
    state = State.build(features)
    return Task(state, target_blocks_on_targets(state), len(towers) * STEP_LIMIT)


def targets_of(state: State) -> tuple[Object, ...]:
    """The targets of a state; as many blocks, the first ones, are target blocks."""
    surfaces = state.layout.of_type(SURFACE)
    return tuple(surface for surface in surfaces if not NOT_IS_TARGET(surface).holds(state))


def target_blocks_on_targets(state: State) -> frozenset[GroundAtom]:
    """The goal: the first block stands on the first target, the second on the second, and so on.

    Raises:
        InvalidStateError: The state has no target, or fewer blocks than targets.
    """
    blocks, targets = state.layout.of_type(BLOCK), targets_of(state)
    if not blocks or not targets:
        raise InvalidStateError("a state of obstacle_tower needs a block and a target")
    if len(blocks) < len(targets):
        raise InvalidStateError(
            f"a state of obstacle_tower needs a block for each target: it has {len(blocks)} "
            f"blocks and {len(targets)} targets"
        )
    return frozenset(ON(block, target) for block, target in zip(blocks, targets, strict=False))


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
            "towers": (1, 3),
        }
    )

    obstacles: tuple[int, int] = (3, 3)  # blocks of each tower, inclusive
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
    # Inclusive; each on a target of its own, for which there is a target block.
    towers: tuple[int, int] = (1, 1)

    @property
    def step_limit(self) -> int:
        """Environment steps of a task with as many towers as there may be."""
        return self.towers[1] * STEP_LIMIT

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with a tower on each target.

        Raises:
            InvalidParameterError: There is no room for so many towers or distractors.
        """
        for _ in range(ARRANGEMENTS - 1):
            with suppress(InvalidParameterError):
                return self._arranged(rng)
        return self._arranged(rng)

    def _arranged(self, rng: np.random.Generator) -> Task:
        """The same, where what is drawn first leaves room for all that comes then.

        Raises:
            InvalidParameterError: It leaves none.
        """
        further = int(rng.integers(self.towers[0], self.towers[1] + 1)) - 1
        obstacles = int(rng.integers(self.obstacles[0], self.obstacles[1] + 1))
        distractors = int(rng.integers(self.distractors[0], self.distractors[1] + 1))
        x, y, yaw = (float(rng.uniform(*r)) for r in (self.target_x, self.target_y, self.yaw))
        targets, towers = [(x, y, yaw)], [self._tower(rng, (x, y, yaw), obstacles)]
        for _ in range(further):
            targets.append(self._further_target(rng, targets))
            obstacles = int(rng.integers(self.obstacles[0], self.obstacles[1] + 1))
            towers.append(self._tower(rng, targets[-1], obstacles))
        taken = [(x, y, APART) for x, y, _ in targets]
        apart = NEARER if further else APART
        standing = [self._stand_apart(rng, taken, apart) for _ in range(len(towers) + distractors)]
        # Last, so that where things stand does not depend on it.
        material = Material(rng.uniform(*self.mass), rng.uniform(*self.friction))
        return make_task(
            [Tower(*parts) for parts in zip(targets, standing, towers, strict=False)],
            standing[len(towers) :],
            material,
        )

    def _tower(
        self, rng: np.random.Generator, target: PlanarPose, obstacles: int
    ) -> tuple[PlanarPose, ...]:
        """Blocks one on the other, from the bottom, none exactly over the middle of the target."""
        x, y, yaw = target
        return tuple(
            (
                x + rng.uniform(-1, 1) * self.stacking_offset,
                y + rng.uniform(-1, 1) * self.stacking_offset,
                yaw + rng.uniform(-1, 1) * self.stacking_turn,
            )
            for _ in range(obstacles)
        )

    def _further_target(
        self, rng: np.random.Generator, targets: Sequence[PlanarPose]
    ) -> PlanarPose:
        """A target beside those that there are.

        Raises:
            InvalidParameterError: There is no room for another target.
        """
        for _ in range(TRIES):
            x, y = rng.uniform(*self.target_x), rng.uniform(*self.block_y)
            if all(math.hypot(x - tx, y - ty) > BETWEEN_TOWERS for tx, ty, _ in targets):
                return x, y, rng.uniform(*self.yaw)
        raise InvalidParameterError(
            f"the table has no room for {len(targets) + 1} towers {BETWEEN_TOWERS} m apart"
        )

    def _stand_apart(
        self, rng: np.random.Generator, taken: list[tuple[float, float, float]], apart: float
    ) -> PlanarPose:
        """A place away from those already taken, which it joins.

        Args:
            rng: Source of random numbers.
            taken: Places taken: x and y, and how far others are from there at least.
            apart: Distance from the new place that is kept then.

        Returns:
            The place.

        Raises:
            InvalidParameterError: There is no room for another block.
        """
        for _ in range(TRIES):
            x, y = rng.uniform(*self.block_x), rng.uniform(*self.block_y)
            if all(math.hypot(x - tx, y - ty) > least for tx, ty, least in taken):
                taken.append((x, y, apart))
                return x, y, rng.uniform(*self.yaw)
        raise InvalidParameterError(
            f"the table has no room for {len(taken)} blocks that stand apart from the tower"
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
    step_limit: ClassVar = STEP_LIMIT

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
