# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Groceries: put one of six things into a basket, in the manner of LIBERO-Object (LG-SAIL §5).

Ten things differ in shape, width, weight and where they are grasped; one operator picks them all.
Read on in this order: ``model`` (types, a metric, predicates, operators, rewards), ``scenery``,
``tasks``, ``demonstrator``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop.presets import BenchtopModel, benchtop_domain
from slap_ros.domains.groceries import demonstrator, model, tasks
from slap_ros.domains.groceries.scenery import scene_of
from slap_ros.domains.variation import varied

SETTINGS: Mapping[str, tasks.RandomGroceryTasks | tasks.PaperGroceryTasks] = {
    "fair": tasks.RandomGroceryTasks(),
    "paper": tasks.PaperGroceryTasks(),
}
MODEL = BenchtopModel(
    types=model.TYPES,
    predicates=model.PREDICATES,
    holding=model.HOLDING,
    goals=model.GOALS,
    acquisition=Acquisition(
        approach=demonstrator.APPROACH,
        operators=model.OPERATORS,
        rewards=model.REWARDS,
        scripts=demonstrator.SCRIPTS,
    ),
    scene_of=scene_of,
    metrics=model.METRICS,
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` puts things anywhere, ``paper`` at places of their own."""
    settings = varied(SETTINGS[preset], changes)
    domain = benchtop_domain("groceries", preset, MODEL, settings)
    return replace(domain, default_goal=tasks.first_in_basket)
