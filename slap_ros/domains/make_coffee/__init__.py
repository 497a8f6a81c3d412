# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make Coffee: put a pod from a drawer into a holder, and close lid and drawer (LG-SAIL).

Read on in this order: ``scenery`` (pod, holder, lid), ``model`` (predicates, operators),
``tasks``, ``demonstrator``. The world is that of ``slap_ros.worlds.contact``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop.presets import BenchtopModel, benchtop_domain
from slap_ros.domains.make_coffee import demonstrator, model
from slap_ros.domains.make_coffee.scenery import scene_of
from slap_ros.domains.make_coffee.tasks import CoffeeTasks
from slap_ros.domains.variation import varied

SETTINGS = {
    "fair": CoffeeTasks(),
    "paper": CoffeeTasks(
        front_x=(0.5, 0.5),
        front_y=(0.335, 0.335),
        front_turn=(0.0, 0.0),
        holder_x=(0.51, 0.51),
        holder_y=(-0.17, -0.17),
        holder_turn=(0.0, 0.0),
    ),
}
MODEL = BenchtopModel(
    types=model.TYPES,
    predicates=model.PREDICATES,
    holding=model.HOLDING,
    goals=model.GOALS,
    acquisition=Acquisition(
        approach=demonstrator.APPROACH,
        operators=model.OPERATORS,
        rewards={reward.operator: reward for reward in model.REWARDS},
        scripts=demonstrator.SCRIPTS,
    ),
    scene_of=scene_of,
    metrics=model.METRICS,
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: ``fair`` varies where all stands, ``paper`` the pod and the lid alone."""
    return benchtop_domain("make_coffee", preset, MODEL, varied(SETTINGS[preset], changes))
