# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: tasks in a world that differs from the planner's model (SLAP, Tables 6 to 8).

What disturbs is as in the published code of the reference: blocks differ in size, mass and
friction, towers are not stacked well, actions have noise, and the hand drops things.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slap_ros.core import Task
from slap_ros.domains.disturbed import Disturbances, with_generator
from slap_ros.domains.obstacle_tower.features import BLOCK
from slap_ros.domains.obstacle_tower.support import CENTRED
from slap_ros.domains.obstacle_tower.tasks import TRIES, PlanarPose, RandomTowerTasks
from slap_ros.domains.tabletop.state_access import HALF_NAMES
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import Object, State
from slap_ros.worlds.joint_space.scene import CUBE_EDGE, TABLE_TOP

SHARE = (0.0, 0.5)  # by which blocks may differ
SEEDS = 2**32  # of generators
ON_EDGE = 0.004  # m, from the edge of a block to what stands on it, so that it stands


@dataclass(frozen=True)
class DisturbedTowerTasks(RandomTowerTasks):
    """Tasks as in the preset ``fair``, with disturbances. Lengths in m, angles in rad.

    Args:
        action_noise: Standard deviation of the noise on each joint's displacement in a step, rad.
        drop_probability: Probability that what is held is let go, in each step.
        size_variation: Share by which the edge of each block is longer or shorter, at most.
        mass_variation: The same of its mass.
        friction_variation: The same of its friction.
        stacking_noise: Standard deviation of each block's place in a tower, along x and y, m.
        stacking_turn_noise: Standard deviation of its yaw, rad.
    """

    limits: ClassVar = RandomTowerTasks.limits | {
        "action_noise": (0.0, 0.1),
        "drop_probability": (0.0, 1.0),
        "size_variation": SHARE,
        "mass_variation": SHARE,
        "friction_variation": SHARE,
        "stacking_noise": (0.0, CUBE_EDGE),
        "stacking_turn_noise": (0.0, math.pi),
    }

    action_noise: float = 0.0
    drop_probability: float = 0.0
    size_variation: float = 0.0
    mass_variation: float = 0.0
    friction_variation: float = 0.0
    stacking_noise: float = 0.0
    stacking_turn_noise: float = 0.0

    @property
    def disturbances(self) -> Disturbances:
        """What disturbs each step."""
        return Disturbances(self.action_noise, self.drop_probability)

    def sample(self, rng: np.random.Generator) -> Task:
        """A task with towers that are not stacked well, of blocks that differ.

        Raises:
            InvalidParameterError: There is no room, or hardly any tower stands.
        """
        apart = rng.spawn(1)[0]  # so that where things stand does not depend on what they are
        task = super().sample(rng)
        varied = self._varied(task.initial_state, apart)
        return replace(task, initial_state=with_generator(varied, int(apart.integers(SEEDS))))

    def _tower(
        self, rng: np.random.Generator, target: PlanarPose, obstacles: int
    ) -> tuple[PlanarPose, ...]:
        """Blocks one on the other; a tower that would fall, or not be on its target, is redrawn."""
        well_stacked = super()._tower(rng, target, obstacles)
        noise = rng.spawn(1)[0]
        spread = (self.stacking_noise, self.stacking_noise, self.stacking_turn_noise)
        for _ in range(TRIES):
            moved = noise.standard_normal((obstacles, 3)) * spread + np.array(well_stacked).reshape(
                -1, 3
            )
            tower: tuple[PlanarPose, ...] = tuple(map(tuple, moved.tolist()))
            if self._stands(target, tower):
                return tower
        raise InvalidParameterError(
            f"hardly any tower of {obstacles} stands with stacking_noise={self.stacking_noise}"
        )

    def _stands(self, target: PlanarPose, tower: Sequence[PlanarPose]) -> bool:
        """Whether the lowest block is on the target, and all above each block is over it."""
        half = CUBE_EDGE / 2 * (1.0 - self.size_variation) - ON_EDGE
        places = [complex(x, y) for x, y, _ in tower]
        if places and abs(places[0] - complex(*target[:2])) > CENTRED:
            return False
        for level, (below, (*_, yaw)) in enumerate(zip(places, tower, strict=True), start=1):
            above = places[level:]
            if above:
                off = (sum(above) / len(above) - below) * complex(math.cos(yaw), -math.sin(yaw))
                if max(abs(off.real), abs(off.imag)) > half:
                    return False
        return True

    def _varied(self, state: State, rng: np.random.Generator) -> State:
        """The state with blocks that differ, each still on what it stands on."""
        changes: dict[tuple[Object, str], float] = {}
        raised = 0.0  # how much higher the top of the block below is
        for block in state.layout.of_type(BLOCK):
            size, mass, friction = (
                float(rng.uniform(1.0 - share, 1.0 + share))
                for share in (self.size_variation, self.mass_variation, self.friction_variation)
            )
            half, z = (float(state.get(block, name)) for name in ("half_z", "z"))
            if z < TABLE_TOP + CUBE_EDGE:
                raised = 0.0  # it stands on the table
            taller = half * size - half
            changes |= {(block, name): half * size for name in HALF_NAMES}
            changes[block, "z"] = z + raised + taller
            changes[block, "mass"] = float(state.get(block, "mass")) * mass
            changes[block, "friction"] = float(state.get(block, "friction")) * friction
            raised += 2.0 * taller
        return state.replace(changes)


STOCHASTIC = DisturbedTowerTasks(
    action_noise=0.01,
    drop_probability=0.01,
    size_variation=0.1,
    mass_variation=0.2,
    friction_variation=0.2,
    stacking_noise=0.01,
    stacking_turn_noise=0.1,
)
PERTURBED = replace(
    STOCHASTIC,
    action_noise=0.02,
    drop_probability=0.02,
    mass_variation=0.3,
    friction_variation=0.3,
)
