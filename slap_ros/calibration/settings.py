# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was identified, in the words that simulator and planner take: a preset, and a file."""

from __future__ import annotations

from slap_ros.calibration.friction import IdentifiedFriction
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.domains.variation import parse_preset

DIGITS = 4  # significant ones of a coefficient


def calibrated_preset(domain: Domain, found: IdentifiedFriction) -> str:
    """The preset of the recording with the friction that was identified.

    Raises:
        InvalidParameterError: The preset has no setting for friction.
    """
    name, changes = parse_preset(domain.preset)
    changes["friction"] = f"{found.friction:.{DIGITS}g}"
    preset = f"{name}:{','.join(f'{key}={value}' for key, value in changes.items())}"
    return get_domain(domain.name, preset).preset  # refused here, not when it is used


def parameter_file(domain: Domain, preset: str, found: IdentifiedFriction) -> str:
    """A parameter file for the launch file, which gives it to simulator and robot_bridge.

    Args:
        domain: Domain that was recorded.
        preset: Preset with the friction.
        found: What it rests on.
    """
    figure = f"{found.friction:.{DIGITS}g} +- {found.plus_minus:.2g}"
    lines = [f"# friction {figure}, from {found.pushes} pushes; they do not tell mass"]
    for node in ("sim_node", "robot_bridge"):
        lines += [
            f"/**/{node}:",
            "  ros__parameters:",
            f"    domain: {domain.name}",
            f'    preset: "{preset}"',
        ]
    return "\n".join(lines) + "\n"
