# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: toys and a wiper from the table into a bin on the floor (SLAP §5).

A Panda at the origin, a table before it and a bin to its left; x to the front, z up, m and rad.
Read on in this order: ``shapes`` (what the toys look like), ``model`` (types, predicates,
operators), ``scenery``, ``tasks``, ``skills``. The world is that of ``slap_ros.physics``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from slap_ros.core import ActionSpace, Display, Domain, Execution, Learning
from slap_ros.domains.cleanup_table import model, skills, tasks
from slap_ros.domains.cleanup_table.learner_interface import LEARNER_INTERFACE
from slap_ros.domains.cleanup_table.scene import scene_of
from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.domains.tabletop.settling import settling
from slap_ros.domains.tabletop.timing import FixedStepTiming, SpeedLimitTiming, Timing
from slap_ros.domains.tabletop.visualization import animation, visible_arm, visible_bodies
from slap_ros.domains.variation import varied
from slap_ros.meshes.solid import Solid
from slap_ros.physics.panda import CONTROL_PERIOD_S
from slap_ros.physics.scene import Scene
from slap_ros.physics.viewpoint import Viewpoint
from slap_ros.physics.world import ACTION_SPACE, PandaWorld
from slap_ros.relational import State

SETTINGS: Mapping[str, tasks.RandomCleanupTasks | tasks.PaperCleanupTasks] = {
    "fair": tasks.RandomCleanupTasks(),
    "paper": tasks.PaperCleanupTasks(),
}
# The reference has no limit to what its planned motions do in a step, and jumps by 3 rad.
UNLIMITED_ACTION_SPACE = replace(
    ACTION_SPACE, low=(*(-math.pi,) * 7, -1.0), high=(*(math.pi,) * 7, 1.0)
)
ACTIONS: Mapping[str, ActionSpace] = {"fair": ACTION_SPACE, "paper": UNLIMITED_ACTION_SPACE}
VIEWPOINT = Viewpoint(eye=(1.7, 1.15, 0.95), target=(0.33, 0.13, 0.13))  # m, into the bin
TIMINGS: Mapping[str, Timing] = {"fair": SpeedLimitTiming(), "paper": FixedStepTiming()}


def make(
    preset: str,
    changes: Mapping[str, str] = MappingProxyType({}),
    shapes: Mapping[str, Solid] | None = None,
) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` has a single one.

    Args:
        preset: ``fair`` or ``paper``.
        changes: Settings of the preset to change.
        shapes: Other toys by kind, and the ``wiper``; those that are shipped, if None. Any mesh
            will do (``slap_ros.meshes``) that the fingers fit around from above.
    """
    shapes = shipped() if shapes is None else shapes
    settings, actions = varied(SETTINGS[preset], changes), ACTIONS[preset]

    def scene(state: State) -> Scene:
        return scene_of(state, shapes)

    return Domain(
        name="cleanup_table",
        preset=preset,
        types=model.TYPES,
        predicates=model.PREDICATES,
        operators=model.OPERATORS,
        skills=skills.skills(TIMINGS[preset]),
        action_space=actions,
        sample_task=lambda rng: settings.sample(rng, shapes),
        make_world=lambda state: PandaWorld(scene(state), state, actions=actions),
        default_goal=tasks.everything_in_the_bin,
        step_limit=tasks.STEP_LIMIT,
        execution=Execution(
            control_period_s=CONTROL_PERIOD_S,
            settle=settling(scene),
        ),
        display=Display(
            bodies=lambda state: visible_bodies(scene(state), state),
            arm=visible_arm,
            animate=animation(scene, VIEWPOINT),
        ),
        learning=Learning(
            interface=LEARNER_INTERFACE,
            actions=ACTION_SPACE,
        ),
        configuration=settings.as_configuration(),
    )
