# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stack at Target: put a cube on a target, and another one on it (LG-SAIL §5).

Read on in this order: ``model`` (types, predicates, operators), ``scenery``, ``tasks``,
``demonstrator``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop.presets import BenchtopModel, benchtop_domain
from slap_ros.domains.stack_at_target import demonstrator, model, scenery, tasks
from slap_ros.domains.variation import varied

SETTINGS = {
    "fair": tasks.StackTasks(),
    "paper": tasks.StackTasks(x=(0.46, 0.64), y=(-0.15, 0.15), yaw=(0.0, 0.0)),
}
MODEL = BenchtopModel(
    types=model.TYPES,
    predicates=model.PREDICATES,
    holding=model.HOLDING,
    goals=model.GOALS,
    scene_of=scenery.scene_of,
    acquisition=Acquisition(
        approach=demonstrator.APPROACH,
        operators=model.OPERATORS,
        rewards=model.REWARDS,
        scripts=demonstrator.SCRIPTS,
    ),
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: ``fair`` spreads things over the table, ``paper`` over less, and not turned."""
    return benchtop_domain("stack_at_target", preset, MODEL, varied(SETTINGS[preset], changes))
