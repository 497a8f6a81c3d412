# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: tasks, sampled so that they can be solved, and the reference's three."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.obstacle2d.dynamics import GRASP_TOLERANCE
from slap_ros.domains.obstacle2d.model import (
    BLOCK,
    BLOCK_SIZE,
    INSIDE_TOLERANCE,
    IS_TARGET,
    ON,
    ROBOT,
    SURFACE,
)
from slap_ros.domains.obstacle2d.skills import nearest_free_place
from slap_ros.domains.variation import TaskSettings
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.relational import GroundAtom, Object, State

STEP_LIMIT = 50  # environment steps (SLAP, appendix)
TABLE_WIDTH = 1.0 + BLOCK_SIZE  # m: block centres range over the unit square
TARGET_WIDTH = BLOCK_SIZE  # m, an area for one block
TRIES = 20_000  # scenes drawn before there is said to be no room
LEAST_OVERLAP = 0.02  # m, by which the obstacle reaches into the target area at least
UNIT_SQUARE = (0.0, 1.0)  # m, along either axis
TOLERANCE_LIMITS = {  # m: below the lower ones, rounding decides
    "grasp_reach": (1e-5, BLOCK_SIZE),
    "grasp_gap": (1e-5, BLOCK_SIZE),
    "inside_tolerance": (1e-5, BLOCK_SIZE),
}

Range = tuple[float, float]


def target_block_in_target_area(state: State) -> frozenset[GroundAtom]:
    """The goal: the first block, which is the target block, lies in the target area.

    Raises:
        InvalidStateError: The state has no block or no target area.
    """
    blocks = state.layout.of_type(BLOCK)
    targets = [s for s in state.layout.of_type(SURFACE) if IS_TARGET(s).holds(state)]
    if not blocks or not targets:
        raise InvalidStateError("a state of obstacle2d needs a block and a target area")
    return frozenset({ON(blocks[0], targets[0])})


@dataclass(frozen=True, kw_only=True)
class Tolerances(TaskSettings):
    """How exact the world and its predicates are, m.

    Args:
        grasp_reach: Largest sideways distance from the gripper to the middle of a block that it
            grasps, m.
        grasp_gap: Largest distance from the gripper down to a block that it grasps, m.
        inside_tolerance: Length by which a block in the target area may reach over its edge, m.
    """

    limits: ClassVar = TOLERANCE_LIMITS

    grasp_reach: float = GRASP_TOLERANCE.reach
    grasp_gap: float = GRASP_TOLERANCE.gap
    inside_tolerance: float = INSIDE_TOLERANCE


@dataclass(frozen=True)
class RandomObstacle2DTasks(Tolerances):
    """Everything is sampled for each task. Lengths in m."""

    limits: ClassVar = TOLERANCE_LIMITS | {
        "bystanders": (0, 10),
        "robot_x": UNIT_SQUARE,
        "robot_y": UNIT_SQUARE,
        "target_x": UNIT_SQUARE,
    }

    bystanders: tuple[int, int] = (0, 2)  # how many blocks stand about besides, inclusive
    robot_x: Range = (0.0, 1.0)
    robot_y: Range = (0.6, 1.0)
    target_x: Range = (0.2, 0.8)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task that picking and placing can solve.

        Scenes are drawn until one leaves room to put the obstacle down off the target area.

        Raises:
            InvalidParameterError: There is no room for so many bystanders.
        """
        bystanders = int(rng.integers(self.bystanders[0], self.bystanders[1] + 1))
        for _ in range(TRIES):
            task = self._draw(rng, bystanders)
            if task is not None:
                return task
        raise InvalidParameterError(f"the table has no room for {bystanders} bystanders")

    def _draw(self, rng: np.random.Generator, bystanders: int) -> Task | None:
        target_x = rng.uniform(*self.target_x)
        reach = BLOCK_SIZE - LEAST_OVERLAP
        obstacle_x = rng.uniform(max(0.0, target_x - reach), min(1.0, target_x + reach))
        placed = [obstacle_x]
        for _ in range(1 + bystanders):
            x = rng.uniform(0.0, 1.0)
            if any(abs(x - other) < BLOCK_SIZE for other in [*placed, target_x]):
                return None
            placed.append(x)
        obstacle_x, target_block_x, *others = placed
        robot = (rng.uniform(*self.robot_x), rng.uniform(*self.robot_y))
        task = make_task(robot, target_x, [target_block_x, obstacle_x, *others])
        obstacle = task.initial_state.layout.object("block2")
        return task if nearest_free_place(task.initial_state, obstacle) is not None else None


@dataclass(frozen=True)
class PaperObstacle2DTasks(Tolerances):
    """The reference's start states: one scene, the obstacle at one of three places."""

    limits: ClassVar = TOLERANCE_LIMITS | {
        "robot": UNIT_SQUARE,
        "target_x": UNIT_SQUARE,
        "target_block_x": UNIT_SQUARE,
        "obstacle_x": UNIT_SQUARE,
    }

    robot: tuple[float, float] = (0.5, 1.0)  # m
    target_x: float = 0.5  # m
    target_block_x: float = 0.8  # m
    obstacle_x: tuple[float, ...] = (0.4, 0.5, 0.6)  # m
    grasp_reach: float = 0.02
    grasp_gap: float = 0.001
    inside_tolerance: float = 1e-4

    def sample(self, rng: np.random.Generator) -> Task:
        """One of the start states."""
        obstacle_x = float(rng.choice(self.obstacle_x))
        return make_task(self.robot, self.target_x, [self.target_block_x, obstacle_x])


SETTINGS: Mapping[str, RandomObstacle2DTasks | PaperObstacle2DTasks] = {
    "fair": RandomObstacle2DTasks(),
    "paper": PaperObstacle2DTasks(),
}


def make_task(robot: tuple[float, float], target_x: float, blocks_x: list[float]) -> Task:
    """A task from positions.

    Args:
        robot: Position x and y of the robot, m.
        target_x: X of the middle of the target area, m.
        blocks_x: X of each block on the table, m; the first block is to go into the target area.

    Returns:
        The task.
    """
    features: dict[Object, dict[str, float]] = {ROBOT("robot"): {"x": robot[0], "y": robot[1]}}
    for i, x in enumerate(blocks_x, start=1):
        features[BLOCK(f"block{i}")] = {"x": x, "y": 0.0, "held": 0.0}
    features[SURFACE("target")] = {"x": target_x, "width": TARGET_WIDTH, "is_target": 1.0}
    features[SURFACE("table")] = {"x": 0.5, "width": TABLE_WIDTH, "is_target": 0.0}
    state = State.build(features)
    return Task(state, target_block_in_target_area(state), STEP_LIMIT)
