# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""KinDER's DynObstruction2D: put a block onto a part of the table that another block stands on.

A side view, lengths in m: x is to the right, y is up. A robot with a round base, an arm and two
fingers flies; blocks are subject to gravity, friction and contacts (pymunk). The skills take
blocks from above, one at a time. That a hand can push is for shortcuts to find. Read on in this
order: ``environment`` (KinDER's, unchanged), ``model`` (types, predicates, operators, tasks),
``skills``.
"""

from __future__ import annotations

from kinder_obstruction import model, skills
from kinder_obstruction.display import visible_bodies
from kinder_obstruction.environment import ACTIONS, BRIDGE, PERIOD
from kinder_obstruction.learner_interface import LEARNED_ACTIONS, LEARNER_INTERFACE
from kinder_obstruction.training import TRAINING
from slap_ros.core import Display, Domain, Execution, Learning
from slap_ros.core.rebuild_each_step import RebuildEachStep


def make() -> Domain:
    """The domain; its tasks are what KinDER's own sampler draws."""
    return Domain(
        name="kinder_obstruction",
        preset="default",
        types=model.TYPES,
        predicates=model.PREDICATES,
        operators=model.OPERATORS,
        skills={skill.name: skill for skill in skills.SKILLS},
        action_space=ACTIONS,
        sample_task=model.sample_task,
        make_world=RebuildEachStep.maker(BRIDGE.make_simulator, ACTIONS),
        default_goal=model.target_on_surface,
        step_limit=model.STEP_LIMIT,
        robot_types=frozenset({model.ROBOT}),
        execution=Execution(control_period_s=PERIOD),
        display=Display(bodies=visible_bodies),
        learning=Learning(
            interface=LEARNER_INTERFACE, actions=LEARNED_ACTIONS, settings={"ours": TRAINING}
        ),
    )
