# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cluttered Drawer: take a block out of a drawer from among surrounding blocks (SLAP §5).

A Panda at the origin, an open drawer before it, a table behind that; x to the front, z up, m and
rad. Read on in this order: ``features`` (types), ``blocking`` (what is in a finger's way),
``predicates``, ``operators``, ``scene``, ``tasks``, ``skills``. The world is that of
``slap_ros.worlds.joint_space``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Display, Domain, Execution, Learning, presets
from slap_ros.domains.cluttered_drawer import features, operators, skills, tasks
from slap_ros.domains.cluttered_drawer.blocking import FingerClearance
from slap_ros.domains.cluttered_drawer.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.cluttered_drawer.predicates import HAND_PREDICATES, predicates
from slap_ros.domains.cluttered_drawer.scene import scene_of
from slap_ros.domains.tabletop.presets import TIMINGS
from slap_ros.domains.tabletop.settling import settling
from slap_ros.domains.tabletop.visualization import animation, visible_arm, visible_bodies
from slap_ros.domains.variation import varied
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.viewpoint import Viewpoint

SETTINGS: Mapping[str, tasks.RandomDrawerTasks | tasks.PaperDrawerTasks] = {
    "fair": tasks.RandomDrawerTasks(),
    "paper": tasks.PaperDrawerTasks(),
}

VIEWPOINT = Viewpoint(
    eye=(0.9, -1.3, 1.0), target=(0.3, 0.0, 0.28)
)  # into the drawer, past the hand


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` has the reference's one."""
    settings = varied(SETTINGS[preset], changes)
    clearance = FingerClearance(settings.reach, settings.half_width)
    return Domain(
        name="cluttered_drawer",
        preset=preset,
        types=features.TYPES,
        predicates=predicates(clearance),
        operators=operators.OPERATORS,
        skills=skills.skills(TIMINGS[settings.timing]),
        action_space=settings.actions,
        sample_task=settings.sample,
        make_world=lambda state: PandaWorld(scene_of(state), state, actions=settings.actions),
        default_goal=tasks.target_block_on_table,
        step_limit=tasks.STEP_LIMIT,
        robot_types=frozenset({ROBOT}),
        robot_predicates=HAND_PREDICATES,
        execution=Execution(
            control_period_s=CONTROL_PERIOD_S,
            settle=settling(scene_of),
        ),
        display=Display(
            bodies=lambda state: visible_bodies(scene_of(state), state),
            arm=visible_arm,
            animate=animation(scene_of, VIEWPOINT),
        ),
        learning=Learning(
            interface=LEARNER_INTERFACE,
            settings=TRAINING_SETTINGS,
            ablations=ABLATIONS,
            actions=settings.learned_actions,
        ),
        configuration=settings.as_configuration(),
    )
