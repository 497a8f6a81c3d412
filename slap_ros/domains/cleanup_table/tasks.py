# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: tasks, all sampled. Lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.cleanup_table.features import BLOCK, HALF, MIDDLE, SURFACE, TOOL
from slap_ros.domains.cleanup_table.predicates import IS_DRAWER, ON
from slap_ros.domains.cleanup_table.scene import BIN, MATERIAL, TABLE, TABLE_TOP, kind_of
from slap_ros.domains.cleanup_table.shapes import WIPER
from slap_ros.domains.tabletop.presets import ARM_LIMITS, ArmSettings
from slap_ros.domains.tabletop.variation_limits import MATERIAL_LIMITS, REACH, TURN
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Vector, from_yaw
from slap_ros.meshes.solid import Solid
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import body_features, pose_features
from slap_ros.worlds.joint_space.features import ROBOT, material_features, robot_features
from slap_ros.worlds.panda import HOME

STEP_LIMIT = 600  # environment steps
TRIES = 1_000  # places drawn for a toy before all are drawn again
ROUNDS = 100  # before there is said to be no room
# In place of the usual settings where so many toys have no room.
ROOMIER: Mapping[str, Any] = {
    "toy_x": (0.4, 0.64),
    "toy_y": (-0.04, 0.26),
    "gap": 0.105,
    "wiper_y": (-0.21, -0.17),
}

PlanarPose = tuple[float, float, float]  # x, y, yaw
Range = tuple[float, float]


def make_task(
    places: Mapping[str, PlanarPose], shapes: Mapping[str, Solid], material: Material = MATERIAL
) -> Task:
    """The task to put everything that stands on the table into the bin.

    Args:
        places: Place of each block, by the block's name.
        shapes: Shape of each kind of block, by the kind's name.
        material: Material of all blocks.

    Returns:
        A task whose goal is that all of them are in the bin.
    """
    features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(HOME)}
    for name, place in places.items():
        block = (TOOL if name == WIPER else BLOCK)(name)
        features[block] = _block(shapes[kind_of(block)], material, *place)
    features[SURFACE("bin")] = _surface(BIN, is_drawer=1.0)
    features[SURFACE("table")] = _surface(TABLE, is_drawer=0.0)
    state = State.build(features)
    return Task(state, everything_in_the_bin(state), STEP_LIMIT)


def everything_in_the_bin(state: State) -> frozenset[GroundAtom]:
    """The goal: every block is in the bin.

    Raises:
        InvalidStateError: The state has no block or no bin.
    """
    blocks = state.layout.of_type(BLOCK)
    bins = [s for s in state.layout.of_type(SURFACE) if IS_DRAWER(s).holds(state)]
    if not blocks or not bins:
        raise InvalidStateError("a state of cleanup_table needs a block and a bin")
    return frozenset(ON(block, bins[0]) for block in blocks)


@dataclass(frozen=True)
class RandomCleanupTasks(ArmSettings):
    """Toys anywhere beside the bin, turned as they like; the wiper on the other side."""

    limits: ClassVar = (
        ARM_LIMITS
        | MATERIAL_LIMITS
        | {
            "toys": (0, 20),
            "toy_x": REACH,
            "toy_y": REACH,
            "toy_yaw": TURN,
            "gap": (0.0, REACH[1]),
            "wiper_x": REACH,
            "wiper_y": REACH,
            "wiper_yaw": TURN,
        }
    )

    toys: tuple[int, int] = (3, 3)  # inclusive
    toy_x: Range = (0.38, 0.62)
    toy_y: Range = (0.06, 0.25)
    toy_yaw: Range = (-math.pi, math.pi)
    gap: float = 0.1  # between the middles of toys at least
    wiper_x: Range = (0.48, 0.52)
    wiper_y: Range = (-0.14, -0.1)
    wiper_yaw: Range = (-0.2, 0.2)
    # Of all toys of a task, and the wiper.
    mass: Range = (MATERIAL.mass_kg, MATERIAL.mass_kg)
    friction: Range = (MATERIAL.friction, MATERIAL.friction)

    def sample(self, rng: np.random.Generator, shapes: Mapping[str, Solid]) -> Task:
        """A task with toys of these shapes, all kinds equally often.

        Raises:
            InvalidParameterError: There is no room for so many.
        """
        count = int(rng.integers(self.toys[0], self.toys[1] + 1))
        for settings in (self, self._roomier()):
            toys = settings._apart(rng, count)
            if toys is not None:
                return settings._laid(rng, toys, shapes)
        raise InvalidParameterError(f"the table has no room for {count} toys {self.gap} m apart")

    def _laid(
        self, rng: np.random.Generator, toys: Sequence[PlanarPose], shapes: Mapping[str, Solid]
    ) -> Task:
        """The task with toys at these places, and the wiper."""
        places = dict(zip(_names(shapes, len(toys)), toys, strict=True))
        wiper = (self.wiper_x, self.wiper_y, self.wiper_yaw)
        x, y, yaw = (rng.uniform(*r) for r in wiper)
        material = Material(rng.uniform(*self.mass), rng.uniform(*self.friction))
        return make_task({**places, WIPER: (x, y, yaw)}, shapes, material)

    def _roomier(self) -> RandomCleanupTasks:
        """The settings for more toys than have room; a range that was set stays as it is."""
        usual = RandomCleanupTasks
        changed = {
            name: value for name, value in ROOMIER.items() if vars(self)[name] == vars(usual)[name]
        }
        return replace(self, **changed)

    def _apart(self, rng: np.random.Generator, count: int) -> list[PlanarPose] | None:
        """Places that keep their distance, drawn again where the last toys find none.

        Returns:
            The places; None where there is no room for so many.
        """
        for _ in range(ROUNDS):
            placed: list[PlanarPose] = []
            for _ in range(TRIES):
                if len(placed) == count:
                    return placed
                x, y = _uniform(rng, self.toy_x), _uniform(rng, self.toy_y)
                for px, py, _ in placed:
                    if math.hypot(x - px, y - py) < self.gap:
                        break
                else:
                    placed.append((x, y, rng.uniform(*self.toy_yaw)))
        return None


# Toys anywhere in the reference's ranges, the wiper where the reference has it.
PAPER = RandomCleanupTasks(
    timing="tens",
    shortcut_speed=1 / 3,
    wiper_x=(0.5, 0.5),
    wiper_y=(-0.12, -0.12),
    wiper_yaw=(0.0, 0.0),
)


def _uniform(rng: np.random.Generator, between: Range) -> float:
    """The number that ``rng.uniform`` draws, in a tenth of the time: a full table takes many."""
    low, high = between
    return low + (high - low) * rng.random()


def _names(shapes: Mapping[str, Solid], count: int) -> Sequence[str]:
    """Names of toys of each kind in turn; numbered from the second of a kind on."""
    kinds = [kind for kind in shapes if kind != WIPER]
    rounds = [kinds, *([f"{kind}{n}" for kind in kinds] for n in range(2, count + 2))]
    return list(islice((name for names in rounds for name in names), count))


def _block(shape: Solid, material: Material, x: float, y: float, yaw: float) -> Mapping[str, float]:
    middle, half = shape.bounds
    z = TABLE_TOP + half[2] - middle.position[2]
    return {
        **body_features((x, y, z), from_yaw(yaw)),
        **material_features(material),
        **_thing(middle.position, half, is_movable=1.0, is_drawer=0.0),
    }


def _surface(box: OrientedBox, is_drawer: float) -> Mapping[str, float]:
    return {
        **pose_features(box.pose),
        **_thing((0.0, 0.0, 0.0), box.half, is_movable=0.0, is_drawer=is_drawer),
    }


def _thing(
    middle: Vector, half: Vector, is_movable: float, is_drawer: float
) -> Mapping[str, float]:
    return {
        **dict(zip(HALF, half, strict=True)),
        **dict(zip(MIDDLE, middle, strict=True)),
        "is_movable": is_movable,
        "is_drawer": is_drawer,
    }
