# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: put a block on a target on which a tower of other blocks stands (SLAP §5).

A Panda at the origin, a table before it; x to the front, z up, m and rad. Read on in this order:
``features`` (types), ``support`` (what lies on what), ``predicates``, ``operators``, ``scene``,
``tasks``, ``skills``. The world is that of ``slap_ros.worlds.joint_space``; ``disturbed_tasks`` has
the tasks of worlds that differ from the planner's model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from slap_ros.core import Domain, Learning, presets
from slap_ros.domains.disturbed import disturbed
from slap_ros.domains.obstacle_tower import features, operators, predicates, skills, tasks
from slap_ros.domains.obstacle_tower.disturbed_tasks import (
    PERTURBED,
    STOCHASTIC,
    DisturbedTowerTasks,
)
from slap_ros.domains.obstacle_tower.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.obstacle_tower.scene import scene_of, sized_scene_of
from slap_ros.domains.tabletop.model import TabletopModel, tabletop_domain
from slap_ros.domains.variation import varied
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.scene import CUBE_MATERIAL

SETTINGS: Mapping[str, tasks.RandomTowerTasks | tasks.PaperTowerTasks] = {
    "fair": tasks.RandomTowerTasks(),
    "paper": tasks.PaperTowerTasks(),
    "stochastic": STOCHASTIC,
    "perturbed": PERTURBED,
}


MODEL = TabletopModel(
    types=features.TYPES,
    predicates=predicates.PREDICATES,
    operators=operators.OPERATORS,
    skills=skills.skills,
    scene_of=scene_of,
    goal=tasks.target_blocks_on_targets,
    step_limit=tasks.STEP_LIMIT,
    robot_types=frozenset({ROBOT}),
    learning=Learning(interface=LEARNER_INTERFACE, settings=TRAINING_SETTINGS, ablations=ABLATIONS),
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain under one of its presets.

    The preset ``fair`` samples different tasks, and ``paper`` has the reference's one. In
    ``stochastic`` and ``perturbed``, the world differs from the planner's model.
    """
    settings = varied(SETTINGS[preset], changes)
    model = replace(MODEL, step_limit=settings.step_limit)
    if not isinstance(settings, DisturbedTowerTasks):
        return tabletop_domain("obstacle_tower", preset, model, settings, settings.sample)
    sized = replace(model, scene_of=sized_scene_of)
    domain = tabletop_domain("obstacle_tower", preset, sized, settings, settings.sample)
    return disturbed(domain, settings.disturbances, CUBE_MATERIAL)
