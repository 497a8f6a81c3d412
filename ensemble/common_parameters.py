# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of perception, planner and skill server alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from rclpy.node import Node

from ensemble.parameters import declare_parameters, parameter, read_parameters
from ensemble.patience import IMPATIENT, PATIENT
from slap_ros.core import Domain
from slap_ros.skills.domain_choice import DomainChoice, open_domain

P = TypeVar("P")
LIBRARIES = "runs/skills"  # where acquisition_node writes


@dataclass(frozen=True)
class CommonParameters:
    """Which domain to prepare for, and how long to wait for anything."""

    domain: str = parameter("", "imported at the start; empty: whichever the simulator announces")
    preset: str = parameter("", "the domain's; empty: its first")
    skills: str = parameter("", "whose skills the domain has; empty: whichever are announced")
    libraries: str = parameter(
        LIBRARIES, "folders below which a library that is announced may lie, separated by ':'"
    )
    patience: float = parameter(
        1.0, "factor of all deadlines, for slow domains and machines", IMPATIENT, PATIENT
    )

    def imported(self) -> Domain | None:
        """The domain, if it is named; to be called before anybody sees the node's servers.

        Raises:
            UnknownDomainError: There is no such domain.
            InvalidParameterError: The domain has no such preset, or no such skills.
            InvalidDomainError: The domain's own code fails.
        """
        choice = DomainChoice(self.domain, self.preset, self.skills)
        return open_domain(choice) if self.domain else None


DEFAULTS = CommonParameters()


def read_with_common(node: Node, kind: type[P]) -> tuple[P, CommonParameters]:
    """Declare the parameters of a node that has the common ones too, and read both.

    Args:
        node: Node that has just been made.
        kind: Dataclass of the parameters that are its own.

    Raises:
        Exception: As :func:`ensemble.parameters.read_parameters`.
    """
    own = declare_parameters(node, kind)
    return own, read_parameters(node, CommonParameters)
