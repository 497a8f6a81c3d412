# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Marbles: get every marble off a tray and into the gutter at its right side.

A tray seen from above, the unit square; lengths in m. The hand is a fan: closed around a marble
it carries it, open and low it is a broom. The skills carry one marble at a time. That open fan
would sweep them all is for shortcuts to find. Read on in this order: ``environment`` (the world,
an ordinary Gymnasium environment), ``model`` (types, predicates, operators, tasks), ``skills``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from marbles import model, skills
from marbles.environment import MAX_STEP, PERIOD, MarblesEnv
from marbles.learner_interface import LEARNER_INTERFACE
from slap_ros.core import ActionSpace, Display, Domain, Execution, GripperAxis, Learning, presets
from slap_ros.core.gymnasium_world import GymnasiumWorld
from slap_ros.domains.variation import varied
from slap_ros.relational import Feature

ACTIONS = ActionSpace(
    axes=(*(Feature(axis, "m") for axis in ("x", "y", "z")), Feature("gripper", "1")),
    low=(-MAX_STEP, -MAX_STEP, -MAX_STEP, -1.0),
    high=(MAX_STEP, MAX_STEP, MAX_STEP, 1.0),
    gripper=GripperAxis("gripper"),
)


@presets(*model.SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` strews marbles, ``paper`` has them in a row."""
    tasks = varied(model.SETTINGS[preset], changes)
    return Domain(
        name="marbles",
        preset=preset,
        types=model.TYPES,
        predicates=model.PREDICATES,
        operators=model.OPERATORS,
        skills={skill.name: skill for skill in skills.SKILLS},
        action_space=ACTIONS,
        sample_task=tasks.sample,
        make_world=GymnasiumWorld.maker(MarblesEnv, ACTIONS),
        default_goal=model.all_in_the_gutter,
        step_limit=model.STEP_LIMIT,
        robot_types=frozenset({model.ROBOT}),
        execution=Execution(
            control_period_s=PERIOD,
        ),
        display=Display(
            bodies=model.visible_bodies,
        ),
        learning=Learning(
            interface=LEARNER_INTERFACE,
        ),
    )
