# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which domains can run on a robot: those with a Panda whose states can be measured."""

from __future__ import annotations

import numpy as np

from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError, OpenLoopOnlyError
from slap_ros.relational import State
from slap_ros.robot.limits import STEP_TOLERANCE, Limits
from slap_ros.worlds.contact.features import ROBOT as HAND_OF_FORCES
from slap_ros.worlds.joint_space.features import ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld


def require_robot(domain: Domain, initial: State) -> None:
    """Refuse a domain without a Panda before anything is started for it.

    Raises:
        InvalidParameterError: Its robot is another one, or its world is disturbed on purpose.
        OpenLoopOnlyError: Its robot is a hand that acts by forces.
    """
    _require_closed_loop(domain)
    if domain.make_model is not None:
        raise InvalidParameterError(
            f"{domain} has disturbances of its own, which only a simulation can have; use another "
            "preset, or --world sim"
        )
    if ROBOT not in domain.types or not isinstance(domain.make_world(initial), PandaWorld):
        raise InvalidParameterError(
            f"{domain.name} has no Panda, which the robots here are: it runs in simulation alone "
            "(--world sim)"
        )


def _require_closed_loop(domain: Domain) -> None:
    """Refuse a domain whose states cannot be measured on an arm that stands between commands."""
    if HAND_OF_FORCES in domain.types:
        raise OpenLoopOnlyError(
            f"{domain.name} cannot run on this robot, whose arm stands between two commands: its "
            "skills act on where the hand was told to be and on its velocity, which nothing "
            "measures then. The robot in MuJoCo is commanded while it moves: use --world mujoco. "
            "Or record a run in simulation: `slap bag replay BAG --to robot --dry-run` checks its "
            "motion"
        )


def require_panda(domain: Domain, limits: Limits) -> None:
    """Refuse a domain that a real arm must not carry out.

    Args:
        domain: Domain of the robot.
        limits: Limits of the arm.

    Raises:
        InvalidParameterError: Its robot is another one, or its joints jump further in a step than
            the limits allow.
        OpenLoopOnlyError: Its robot is a hand that acts by forces.
    """
    _require_closed_loop(domain)
    if ROBOT not in domain.types:
        raise InvalidParameterError(f"{domain.name} has no Panda, which a real robot is here")
    reach, _ = domain.action_space.split(np.array(domain.action_space.high))
    if any(a > b + STEP_TOLERANCE for a, b in zip(reach, limits.step, strict=True)):
        raise InvalidParameterError(
            f"preset {domain.preset} of {domain.name} lets joints jump by up to {max(reach):.2f} "
            "rad in a step, which a real arm must not: use preset fair"
        )
