# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D with the gripper as the first axis, which closes below 0: in m between fingers."""

from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Action, ActionSpace, Domain, GripperAxis, Learning, Policy, Skill
from slap_ros.domains import get_domain
from slap_ros.domains.obstacle2d.dynamics import MAX_STEP, Obstacle2DWorld
from slap_ros.relational import Feature, Object, State

WIDTH = 0.05
ACTIONS = ActionSpace(
    axes=(Feature("fingers", "m"), Feature("x", "m"), Feature("y", "m")),
    low=(-WIDTH, -MAX_STEP, -MAX_STEP),
    high=(WIDTH, MAX_STEP, MAX_STEP),
    gripper=GripperAxis("fingers", closes=-WIDTH, opens=WIDTH),
)


class World(Obstacle2DWorld):
    """Takes such actions."""

    def step(self, action: Action) -> State:
        ACTIONS.check(action)
        fingers, x, y = action
        return super().step(np.array([x, y, -fingers / WIDTH]))


@dataclass(frozen=True)
class Reordered:
    """A skill of Obstacle 2D."""

    skill: Skill

    @property
    def name(self) -> str:
        return self.skill.name

    @property
    def step_limit(self) -> int:
        return self.skill.step_limit

    @property
    def least_steps(self) -> int:
        return self.skill.least_steps

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        return self.skill.lower_bound(state, objects)

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        policy = self.skill.start(state, objects)

        def reordered(state: State) -> Action | None:
            action = policy(state)
            return None if action is None else np.array([-WIDTH * action[2], *action[:2]])

        return reordered


def make(preset: str = "default") -> Domain:
    flat = get_domain("obstacle2d", "fair")
    return replace(
        flat,
        name="gripper_first",
        preset=preset,
        skills={name: Reordered(skill) for name, skill in flat.skills.items()},
        action_space=ACTIONS,
        make_world=World,
        learning=Learning(flat.learning.interface),
    )
