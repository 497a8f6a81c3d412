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

from slap_ros.core import Domain, Learning, presets
from slap_ros.domains.cluttered_drawer import features, operators, skills, tasks
from slap_ros.domains.cluttered_drawer.blocking import FingerClearance
from slap_ros.domains.cluttered_drawer.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.cluttered_drawer.predicates import HAND_PREDICATES, predicates
from slap_ros.domains.cluttered_drawer.scene import scene_of
from slap_ros.domains.tabletop.model import TabletopModel, tabletop_domain
from slap_ros.domains.variation import varied
from slap_ros.worlds.joint_space.features import ROBOT
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
    model = TabletopModel(
        types=features.TYPES,
        predicates=predicates(clearance),
        operators=operators.OPERATORS,
        skills=skills.skills,
        scene_of=scene_of,
        goal=tasks.target_block_on_table,
        step_limit=tasks.STEP_LIMIT,
        robot_types=frozenset({ROBOT}),
        robot_predicates=HAND_PREDICATES,
        learning=Learning(
            interface=LEARNER_INTERFACE, settings=TRAINING_SETTINGS, ablations=ABLATIONS
        ),
        view=VIEWPOINT,
    )
    return tabletop_domain("cluttered_drawer", preset, model, settings, settings.sample)
