# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: put the target block into an area that another block overlaps (SLAP §5).

A side view of a table in the unit square. All lengths are in metres, x to the right, y up,
positions are centres. Read on in this order: ``model`` (types, predicates, operators),
``dynamics`` (the world), ``skills``, ``tasks``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from slap_ros.core import Display, Domain, Execution, Learning, presets
from slap_ros.domains.obstacle2d import model, skills, tasks
from slap_ros.domains.obstacle2d.bodies import visible_bodies
from slap_ros.domains.obstacle2d.dynamics import (
    ACTION_SPACE,
    CONTROL_PERIOD,
    GraspTolerance,
    Obstacle2DVectorWorld,
    Obstacle2DWorld,
    settle,
)
from slap_ros.domains.obstacle2d.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.variation import varied


@presets(*tasks.SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` the reference's three."""
    settings = varied(tasks.SETTINGS[preset], changes)
    tolerance = GraspTolerance(settings.grasp_reach, settings.grasp_gap)
    return Domain(
        name="obstacle2d",
        preset=preset,
        types=model.TYPES,
        predicates=model.predicates(settings.inside_tolerance),
        operators=model.OPERATORS,
        skills={skill.name: skill for skill in skills.SKILLS},
        action_space=ACTION_SPACE,
        sample_task=settings.sample,
        make_world=partial(Obstacle2DWorld, tolerance=tolerance),
        default_goal=tasks.target_block_in_target_area,
        step_limit=tasks.STEP_LIMIT,
        robot_types=frozenset({model.ROBOT}),
        execution=Execution(
            control_period_s=CONTROL_PERIOD,
            settle=settle,
        ),
        display=Display(
            bodies=visible_bodies,
        ),
        learning=Learning(
            interface=LEARNER_INTERFACE,
            settings=TRAINING_SETTINGS,
            ablations=ABLATIONS,
            make_vector_world=partial(Obstacle2DVectorWorld, tolerance=tolerance),
        ),
        configuration=settings.as_configuration(),
    )
