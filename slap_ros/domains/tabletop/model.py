# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a domain at a table says of itself, and the domain that it makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Display, Domain, Execution, Goal, Learning, Skill, Task
from slap_ros.domains.tabletop.lifting import lifting
from slap_ros.domains.tabletop.presets import TIMINGS, ArmSettings
from slap_ros.domains.tabletop.settling import settling
from slap_ros.domains.tabletop.timing import Timing
from slap_ros.domains.tabletop.visualization import (
    SceneOf,
    animation,
    visible_arm,
    visible_bodies,
)
from slap_ros.relational import LiftedOperator, Predicate, Type
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.viewpoint import Viewpoint


@dataclass(frozen=True)
class TabletopModel:
    """The parts of a domain at a table that it does not share with the others.

    Args:
        types: Types of the domain's objects, parents first, the robot's among them.
        predicates: All predicates of the domain.
        operators: All operators of the domain.
        skills: Function that makes a skill for each operator, by the operator's name.
        scene_of: Function from a state to its bodies.
        goal: Goal of tasks that have none of their own.
        step_limit: Largest number of control steps of a task.
        learning: Settings of how shortcuts are learned; their actions follow from the domain's
            settings.
        robot_types: Types whose features a robot measures by itself.
        robot_predicates: Predicates that a robot measures by itself.
        view: Viewpoint of animations.
    """

    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    operators: tuple[LiftedOperator, ...]
    skills: Callable[[Timing], Mapping[str, Skill]]
    scene_of: SceneOf
    goal: Goal
    step_limit: int
    learning: Learning
    robot_types: frozenset[Type] = frozenset()
    robot_predicates: frozenset[Predicate] = frozenset()
    view: Viewpoint | None = None


def tabletop_domain(
    name: str,
    preset: str,
    model: TabletopModel,
    settings: ArmSettings,
    sample: Callable[[np.random.Generator], Task],
) -> Domain:
    """The domain that a model makes at a table.

    Args:
        name: Name of the domain.
        preset: Name of the preset that the settings come from.
        model: Parts of the domain that it does not share with the others.
        settings: Settings of how the arm may move.
        sample: Function that samples a task.

    Returns:
        The domain.

    Raises:
        InvalidDomainError: Its parts do not fit.
    """
    return Domain(
        name=name,
        preset=preset,
        types=model.types,
        predicates=model.predicates,
        operators=model.operators,
        skills=model.skills(TIMINGS[settings.timing]),
        action_space=settings.actions,
        sample_task=sample,
        make_world=lambda state: PandaWorld(model.scene_of(state), state, actions=settings.actions),
        default_goal=model.goal,
        step_limit=model.step_limit,
        robot_types=model.robot_types,
        robot_predicates=model.robot_predicates,
        execution=Execution(
            control_period_s=CONTROL_PERIOD_S,
            settle=settling(model.scene_of),
            clear=lifting(model.scene_of),
        ),
        display=Display(
            bodies=lambda state: visible_bodies(model.scene_of(state), state),
            arm=visible_arm,
            animate=animation(model.scene_of, model.view),
        ),
        learning=replace(model.learning, actions=settings.learned_actions),
        configuration=settings.as_configuration(),
    )
