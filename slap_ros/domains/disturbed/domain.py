# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A domain with disturbances in its world, and none in its planner's model."""

from __future__ import annotations

from dataclasses import replace

from slap_ros.core import Domain
from slap_ros.domains.disturbed.disturbances import Disturbances
from slap_ros.domains.disturbed.generator import GENERATOR
from slap_ros.domains.disturbed.worlds import Belief, DisturbedWorld, NominalWorld
from slap_ros.worlds.bodies import Material


def disturbed(domain: Domain, disturbances: Disturbances, material: Material) -> Domain:
    """The domain whose world is disturbed.

    Args:
        domain: Domain whose tasks have a generator among their objects. Its world has things of the
            sizes and materials that the state says.
        disturbances: What disturbs the robot's actions.
        material: Material that planners take everything for that can be grasped.

    Returns:
        A domain with the same tasks, in which plans are made without disturbances and executed
        with them.
    """
    make_world, actions, belief = domain.make_world, domain.action_space, Belief(material)
    return replace(
        domain,
        types=(*domain.types, GENERATOR),
        make_world=lambda state: DisturbedWorld(make_world, state, actions, disturbances),
        make_model=lambda state: NominalWorld(make_world, state, belief),
    )
