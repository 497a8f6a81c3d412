# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: toys and a wiper from the table into a bin on the floor (SLAP §5).

A Panda at the origin, a table before it and a bin to its left; x to the front, z up, m and rad.
Read on in this order: ``shapes`` (what the toys look like), ``features`` (types), ``relations``
(what is on what), ``predicates``, ``operators``, ``scene``, ``tasks``, ``skills``. The world is
that of ``slap_ros.worlds.joint_space``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Display, Domain, Execution, Learning, presets
from slap_ros.domains.cleanup_table import features, operators, predicates, skills, tasks
from slap_ros.domains.cleanup_table.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.cleanup_table.scene import scene_of
from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.domains.tabletop.presets import TIMINGS
from slap_ros.domains.tabletop.settling import settling
from slap_ros.domains.tabletop.visualization import animation, visible_arm, visible_bodies
from slap_ros.domains.variation import varied
from slap_ros.meshes.solid import Solid
from slap_ros.relational import State
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.viewpoint import Viewpoint

SETTINGS: Mapping[str, tasks.RandomCleanupTasks] = {
    "fair": tasks.RandomCleanupTasks(),
    "paper": tasks.PAPER,
}
VIEWPOINT = Viewpoint(eye=(1.7, 1.15, 0.95), target=(0.33, 0.13, 0.13))  # m, into the bin


@presets(*SETTINGS)
def make(
    preset: str,
    changes: Mapping[str, str] = MappingProxyType({}),
    shapes: Mapping[str, Solid] | None = None,
) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` fewer, at the paper's pace.

    Args:
        preset: ``fair`` or ``paper``.
        changes: Settings of the preset to change.
        shapes: Other toys by kind, and the ``wiper``; those that are shipped, if None. Any mesh
            will do (``slap_ros.meshes``) that the fingers fit around from above.

    Returns:
        The domain.

    Raises:
        InvalidParameterError: No such setting, or it cannot have that value.
    """
    shapes = shipped() if shapes is None else shapes
    settings = varied(SETTINGS[preset], changes)

    def scene(state: State) -> Scene:
        return scene_of(state, shapes)

    return Domain(
        name="cleanup_table",
        preset=preset,
        types=features.TYPES,
        predicates=predicates.PREDICATES,
        operators=operators.OPERATORS,
        skills=skills.skills(TIMINGS[settings.timing]),
        action_space=settings.actions,
        sample_task=lambda rng: settings.sample(rng, shapes),
        make_world=lambda state: PandaWorld(scene(state), state, actions=settings.actions),
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
            settings=TRAINING_SETTINGS,
            ablations=ABLATIONS,
            actions=settings.learned_actions,
        ),
        configuration=settings.as_configuration(),
    )
