# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cleanup Table: toys and a wiper from the table into a bin on the floor (SLAP §5).

A Panda at the origin, a table before it and a bin to its left; x to the front, z up, m and rad.
Read on in this order: ``shapes`` (what the toys look like), ``features`` (types), ``relations``
(what is on what), ``predicates``, ``operators``, ``scene``, ``tasks``, ``skills``. The world is
that of ``slap_ros.worlds.joint_space``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from slap_ros.core import Domain, Learning, presets
from slap_ros.domains.cleanup_table import features, operators, predicates, skills, tasks
from slap_ros.domains.cleanup_table.learner_interface import (
    ABLATIONS,
    LEARNER_INTERFACE,
    TRAINING_SETTINGS,
)
from slap_ros.domains.cleanup_table.scene import scene_of
from slap_ros.domains.cleanup_table.shapes import shipped
from slap_ros.domains.tabletop.model import TabletopModel, tabletop_domain
from slap_ros.domains.variation import varied
from slap_ros.meshes.solid import Solid
from slap_ros.worlds.viewpoint import Viewpoint

SETTINGS: Mapping[str, tasks.RandomCleanupTasks] = {
    "fair": tasks.RandomCleanupTasks(),
    "paper": tasks.PAPER,
}
VIEWPOINT = Viewpoint(eye=(1.7, 1.15, 0.95), target=(0.33, 0.13, 0.13))  # m, into the bin


@presets(*SETTINGS)
def make(
    preset: str,
    changes: Mapping[str, str] = MappingProxyType({}),
    shapes: Mapping[str, Solid] | None = None,
) -> Domain:
    """The domain: preset ``fair`` samples different tasks, ``paper`` fewer, at the paper's pace.

    Args:
        preset: Name of the preset: ``fair`` or ``paper``.
        changes: Settings of the preset to change.
        shapes: Toys by kind, and the ``wiper``, in place of those that are shipped; None for these.
            Any mesh will do (``slap_ros.meshes``) that the fingers fit around from above.

    Returns:
        The domain.

    Raises:
        InvalidParameterError: No such setting, or it cannot have that value.
    """
    shapes = shipped() if shapes is None else shapes
    settings = varied(SETTINGS[preset], changes)

    model = TabletopModel(
        types=features.TYPES,
        predicates=predicates.PREDICATES,
        operators=operators.OPERATORS,
        skills=skills.skills,
        scene_of=lambda state: scene_of(state, shapes),
        goal=tasks.everything_in_the_bin,
        step_limit=tasks.STEP_LIMIT,
        learning=Learning(
            interface=LEARNER_INTERFACE, settings=TRAINING_SETTINGS, ablations=ABLATIONS
        ),
        view=VIEWPOINT,
    )
    return tabletop_domain(
        "cleanup_table", preset, model, settings, lambda rng: settings.sample(rng, shapes)
    )
