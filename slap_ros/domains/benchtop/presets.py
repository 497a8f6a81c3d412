# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Putting a domain together: what all domains at a bench have in common is said once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Protocol

import numpy as np

from slap_ros.core import (
    Acquisition,
    Domain,
    Execution,
    Goal,
    Learning,
    SettingValue,
    Task,
)
from slap_ros.domains.benchtop.learner_interface import learner_interface
from slap_ros.domains.benchtop.metrics import COMMON
from slap_ros.domains.benchtop.primitives import PRIMITIVES
from slap_ros.domains.benchtop.sides import make_sides
from slap_ros.domains.benchtop.visualization import VIEW, display
from slap_ros.relational import Layout, Metric, Predicate, State, Type
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.clearing import cleared
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.hand_model import HANDS, HandModel
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.settling import settled
from slap_ros.worlds.contact.world import ACTION_SPACE, ContactWorld
from slap_ros.worlds.viewpoint import Viewpoint

STEP_LIMIT = 1_000  # environment steps of a task
HORIZON = 50  # environment steps of a learned skill, approach not counted
PUSH_S = 2.0  # s, in which a hand crosses the table twice
# Shortcuts here are pushes: near what they push they need few rollouts, and a short time.
NEAR_SETTINGS = {
    "exploration.length": round(PUSH_S / CONTROL_PERIOD_S),
    "exploration.nodes": 4,
    "exploration.rollouts": 4,
    "horizon": round(PUSH_S / CONTROL_PERIOD_S),
    "polish": None,
    "ppo.total_steps": 60_000,
    "starts": 100,
}


class BenchtopTasks(Protocol):
    """What tasks are sampled from: a dataclass of settings, one for each preset."""

    @property
    def hand(self) -> str:
        """The name of the hand."""
        ...

    def sample(self, rng: np.random.Generator) -> Task:
        """A task; no two are alike."""
        ...

    def as_configuration(self) -> Mapping[str, str]:
        """The settings by name."""
        ...


@dataclass(frozen=True)
class BenchtopModel:
    """The parts of a domain at a bench that it does not share with the others.

    Args:
        types: Types besides the robot's, parents first.
        predicates: All predicates of the domain.
        holding: Predicate of what is held, one of ``predicates``.
        goals: Goals by name; the domain trains for the first one.
        acquisition: Operators, rewards and scripts written by hand, and the approach.
        scene_of: Function from a state to its bodies. Bodies that move and are not in the state are
            left out, since perception may not know where they are.
        metrics: Metrics besides those that every domain has and those that predicates use.
        static: Predicates that nothing changes.
        view: Viewpoint of animations.
        chains: Training settings where two skills in a row show a shortcut (``ours_chains``), where
            they differ from the usual ones.
    """

    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    holding: Predicate
    goals: Mapping[str, Goal]
    acquisition: Acquisition
    scene_of: Callable[[State], ContactScene]
    metrics: tuple[Metric, ...] = ()
    static: frozenset[Predicate] = frozenset()
    view: Viewpoint = VIEW
    chains: Mapping[str, SettingValue] = field(default_factory=dict)


def benchtop_domain(
    name: str, preset: str, model: BenchtopModel, settings: BenchtopTasks
) -> Domain:
    """The domain; it has no operators and no skills, as these are acquired.

    Args:
        name: Name of the domain.
        preset: Name of the preset that the settings come from.
        model: Parts of the domain that it does not share with the others.
        settings: Settings that tasks are sampled from.

    Returns:
        The domain.

    Raises:
        InvalidDomainError: Its parts do not fit.
    """
    hand = HANDS[settings.hand]

    def scene_of(state: State) -> ContactScene:
        return acted_on(model.scene_of(state), state.layout, hand)

    return Domain(
        name=name,
        preset=preset,
        types=(ROBOT, *model.types),
        predicates=model.predicates,
        action_space=ACTION_SPACE,
        sample_task=settings.sample,
        make_world=lambda state: ContactWorld(scene_of(state), state),
        default_goal=next(iter(model.goals.values())),
        step_limit=STEP_LIMIT,
        execution=Execution(
            control_period_s=CONTROL_PERIOD_S,
            settle=lambda state: settled(scene_of(state), state),
            clear=lambda state: cleared(scene_of(state), state),
        ),
        display=display(scene_of, model.view),
        metrics=(*COMMON, *model.metrics),
        static=model.static,
        goals=model.goals,
        robot_types=frozenset({ROBOT}),
        learning=Learning(
            interface=learner_interface(model.holding, scene_of),
            settings={"ours_near": NEAR_SETTINGS, "ours_chains": model.chains},
        ),
        acquisition=replace(model.acquisition, primitives=PRIMITIVES, sides=make_sides(scene_of)),
        configuration=settings.as_configuration(),
    )


@lru_cache(maxsize=256)
def acted_on(scene: ContactScene, layout: Layout, hand: HandModel) -> ContactScene:
    """The scene as a state's world has it.

    Args:
        scene: Scene of the domain.
        layout: Layout of the state: bodies that move and are none of its objects are left out.
        hand: Hand that acts there.
    """
    moving = {body.name for body in scene.free} | {body.name for body in scene.jointed}
    missing = moving - layout.by_name.keys()
    if not missing and hand == scene.hand:
        return scene
    bodies = tuple(body for body in scene.bodies if body.name not in missing)
    return replace(scene, bodies=bodies, hand=hand)
