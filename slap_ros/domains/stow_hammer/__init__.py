# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stow Hammer: put hammers into the drawers of cabinets (LG-SAIL).

Read on in this order: ``model``, ``scenery``, ``tasks``, ``demonstrator``. The world is that of
``slap_ros.worlds.contact``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop import drawers
from slap_ros.domains.benchtop.approach import make_approach
from slap_ros.domains.benchtop.presets import BenchtopModel, benchtop_domain
from slap_ros.domains.stow_hammer import demonstrator, model
from slap_ros.domains.stow_hammer.scenery import scene_of
from slap_ros.domains.stow_hammer.tasks import StowTasks
from slap_ros.domains.variation import varied

SETTINGS = {
    "fair": StowTasks(),
    "paper": StowTasks(front_x=(0.47, 0.47), front_y=(0.355, 0.355), front_turn=(0.0, 0.0)),
}
# Two skills take 80 environment steps, and the same is done at one cabinet and then at the other.
# With four samples, planning for one task of validation takes most of a minute.
CHAINS = {
    "cloning.anywhere": True,
    "cloning.horizon": 80,
    "cloning.straightened": 80,
    "exploration.nodes": 9,
    "exploration.tasks": 2,
    "horizon": 90,
    "sampling.refinements": 0,
    "sampling.samples": 1,
    "starts": 120,
    "validation": 4,
}
MODEL = BenchtopModel(
    types=model.TYPES,
    predicates=model.PREDICATES,
    holding=model.HOLDING,
    goals=model.GOALS,
    acquisition=Acquisition(
        approach=make_approach(
            demonstrator.acts_at,
            height=lambda _: drawers.TRAVEL_HEIGHT,
            turned=demonstrator.TURNED,
        ),
        operators=model.OPERATORS,
        rewards={reward.operator: reward for reward in model.REWARDS},
        scripts=demonstrator.SCRIPTS,
    ),
    scene_of=scene_of,
    metrics=drawers.METRICS,
    chains=CHAINS,
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: preset ``fair`` varies where all stands, ``paper`` only where hammers lie."""
    return benchtop_domain("stow_hammer", preset, MODEL, varied(SETTINGS[preset], changes))
