# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bowls: put a bowl on the plate from one of ten spots, as in LIBERO-Spatial (LG-SAIL §5).

Read on in this order: ``model`` (types, metrics, predicates, operators, rewards), ``scenery``,
``demonstrator``, ``tasks``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop.presets import BenchtopModel, benchtop_domain
from slap_ros.domains.bowls import demonstrator, model, scenery, tasks
from slap_ros.domains.variation import varied

SETTINGS: Mapping[str, tasks.RandomBowlTasks | tasks.PaperBowlTasks] = {
    "fair": tasks.RandomBowlTasks(),
    "paper": tasks.PaperBowlTasks(),
}
MODEL = BenchtopModel(
    types=model.TYPES,
    predicates=model.PREDICATES,
    holding=model.HOLDING,
    goals=model.GOALS,
    scene_of=scenery.scene_of,
    metrics=model.METRICS,
    acquisition=Acquisition(
        approach=demonstrator.APPROACH,
        operators=model.OPERATORS,
        rewards=model.REWARDS,
        scripts=demonstrator.SCRIPTS,
    ),
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: ``fair`` puts furniture anywhere, ``paper`` in places of its own."""
    settings = varied(SETTINGS[preset], changes)
    domain = benchtop_domain("bowls", preset, MODEL, settings)
    return replace(domain, default_goal=tasks.first_on_plate)
