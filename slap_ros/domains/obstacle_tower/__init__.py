# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: put a block on a target on which a tower of other blocks stands (SLAP §5).

A Panda at the origin, a table before it; x to the front, z up, m and rad. Read on in this order:
``features`` (types), ``support`` (what lies on what), ``predicates``, ``operators``, ``scene``,
``tasks``, ``skills``. The world is that of ``slap_ros.worlds.joint_space``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Display, Domain, Execution, Learning, presets
from slap_ros.domains.obstacle_tower import features, operators, predicates, skills, tasks
from slap_ros.domains.obstacle_tower.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.obstacle_tower.scene import scene_of
from slap_ros.domains.tabletop.presets import TIMINGS
from slap_ros.domains.tabletop.settling import settling
from slap_ros.domains.tabletop.visualization import animation, visible_arm, visible_bodies
from slap_ros.domains.variation import varied
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import CONTROL_PERIOD_S

SETTINGS: Mapping[str, tasks.RandomTowerTasks | tasks.PaperTowerTasks] = {
    "fair": tasks.RandomTowerTasks(),
    "paper": tasks.PaperTowerTasks(),
}


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` has the reference's one."""
    settings = varied(SETTINGS[preset], changes)
    return Domain(
        name="obstacle_tower",
        preset=preset,
        types=features.TYPES,
        predicates=predicates.PREDICATES,
        operators=operators.OPERATORS,
        skills=skills.skills(TIMINGS[settings.timing]),
        action_space=settings.actions,
        sample_task=settings.sample,
        make_world=lambda state: PandaWorld(scene_of(state), state, actions=settings.actions),
        default_goal=tasks.target_block_on_target,
        step_limit=tasks.STEP_LIMIT,
        robot_types=frozenset({ROBOT}),
        execution=Execution(
            control_period_s=CONTROL_PERIOD_S,
            settle=settling(scene_of),
        ),
        display=Display(
            bodies=lambda state: visible_bodies(scene_of(state), state),
            arm=visible_arm,
            animate=animation(scene_of),
        ),
        learning=Learning(
            interface=LEARNER_INTERFACE,
            settings=TRAINING_SETTINGS,
            ablations=ABLATIONS,
            actions=settings.learned_actions,
        ),
        configuration=settings.as_configuration(),
    )
