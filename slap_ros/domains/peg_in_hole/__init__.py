# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Peg in Hole: two pegs go into the horizontal holes of two plates (LG-SAIL's PegInHole).

Read on in this order: ``scenery`` (pegs and plates), ``model`` (types, predicates, operators),
``tasks``, ``demonstrator``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Acquisition, Domain, presets
from slap_ros.domains.benchtop.presets import HORIZON, BenchtopModel, benchtop_domain
from slap_ros.domains.peg_in_hole import demonstrator, model
from slap_ros.domains.peg_in_hole.scenery import scene
from slap_ros.domains.peg_in_hole.tasks import GOALS, MM, PegTasks
from slap_ros.domains.variation import varied
from slap_ros.worlds.viewpoint import Viewpoint

SETTINGS = {
    "fair": PegTasks(),
    # Where the paper's pegs and plates are is not printed. Here the plates stand still.
    "paper": PegTasks(
        peg_yaw=(-0.1, 0.1),
        plate_x=(0.695, 0.695),
        plate_y=(0.12, 0.12),
        plate_yaw=(0.0, 0.0),
        height=(0.14, 0.14),
    ),
}
VIEW = Viewpoint(eye=(1.2, -0.6, 0.5), target=(0.52, 0.0, 0.12))  # onto the plates' far sides
ACQUISITION = Acquisition(
    approach=demonstrator.APPROACH,
    operators=model.OPERATORS,
    rewards=model.REWARDS,
    scripts=demonstrator.SCRIPTS,
    horizon=HORIZON,
)


@presets(*SETTINGS)
def make(preset: str, changes: Mapping[str, str] = MappingProxyType({})) -> Domain:
    """The domain: plates are moved about and turned in ``fair``, and stand still in ``paper``."""
    settings = varied(SETTINGS[preset], changes)
    bodies = scene(settings.clearance * MM)
    of_clearance = BenchtopModel(
        types=model.TYPES,
        predicates=model.PREDICATES,
        holding=model.HOLDING,
        goals=GOALS,
        acquisition=ACQUISITION,
        scene_of=lambda _: bodies,
        metrics=model.METRICS,
        static=model.STATIC,
        view=VIEW,
    )
    return benchtop_domain("peg_in_hole", preset, of_clearance, settings)
