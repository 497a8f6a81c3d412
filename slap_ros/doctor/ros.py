# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which ROS 2 the nodes would run on, and whether it fits."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field

from slap_ros.doctor import settings as variables
from slap_ros.doctor.check import Check
from slap_ros.doctor.processes import PROBE, run_python

DISTRO = "jazzy"
CYCLONE = "rmw_cyclonedds_cpp"
IMPORT_LIMIT_S = 40.0


@dataclass(frozen=True)
class RclpyStatus:
    """What a process that imports rclpy says about it."""

    error: str = ""  # why there is none
    embedded: bool = False  # rather than a ROS 2 installation's
    middleware: str = ""
    slap_msgs: str = ""  # why they cannot be imported
    versions: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def ask(cls) -> RclpyStatus:
        """Import rclpy in another process."""
        outcome = run_python(["-m", PROBE, "about"], IMPORT_LIMIT_S)
        if outcome.code != 0:
            return cls(error=outcome.last_error)
        answer = json.loads(outcome.output.splitlines()[-1])
        if "error" in answer:
            return cls(error=answer["error"])
        return cls(
            "",
            answer["embedded"],
            answer["middleware"],
            answer["slap_msgs"],
            answer["versions"],
        )


def installation(about: RclpyStatus) -> Check:
    """A sourced ROS 2 Jazzy, or else the embedded runtime."""
    name, distro = "ROS 2", os.environ.get("ROS_DISTRO", "")
    if about.error:
        return Check(
            name,
            "problem",
            f"rclpy cannot be imported: {about.error}",
            "Source a ROS 2 Jazzy of this Python version, or pip install embedded-ros.",
        )
    if distro and distro != DISTRO:
        return Check(
            name,
            "problem",
            f"ROS 2 {distro} is sourced",
            f"Source ROS 2 {DISTRO} instead, or none: then the embedded runtime serves.",
        )
    if not about.embedded:
        return Check(name, "ok", f"ROS 2 {distro or 'of unknown name'} is sourced")
    runtime = f"embedded_ros {about.versions.get('embedded-ros', 'of unknown version')}"
    if distro:
        return Check(
            name,
            "warning",
            f"ROS 2 {distro} is sourced, but this Python cannot import its rclpy; "
            f"{runtime} serves instead",
            "Use the Python of that ROS 2, in a virtual environment with --system-site-packages.",
        )
    return Check(name, "ok", f"not sourced, and not needed: {runtime} serves")


def middleware(about: RclpyStatus) -> Check:
    """CycloneDDS on all sides: services and actions do not cross to another middleware."""
    name, wanted = "ROS 2 middleware", os.environ.get("RMW_IMPLEMENTATION", "")
    advice = f"export RMW_IMPLEMENTATION={CYCLONE} for every node."
    if about.error:
        return Check(name, "problem", "none, because rclpy cannot be imported", "See ROS 2.")
    if about.embedded and wanted not in ("", CYCLONE):
        return Check(
            name,
            "problem",
            f"RMW_IMPLEMENTATION is {wanted}, but embedded nodes speak through CycloneDDS; "
            "services and actions would not reach nodes that do as it says",
            advice,
        )
    if about.embedded:
        return Check(name, "ok", f"CycloneDDS {about.versions.get('cyclonedds', '')}".strip())
    if about.middleware != CYCLONE:
        return Check(
            name,
            "warning",
            f"{about.middleware}: services and actions do not reach embedded nodes",
            f"Where some machines have no ROS 2, {advice}",
        )
    return Check(name, "ok", about.middleware)


def interfaces(about: RclpyStatus) -> Check:
    """The message types of slap_msgs."""
    name = "slap_msgs"
    if about.error:
        return Check(name, "problem", "not looked for, without rclpy", "See ROS 2.")
    if not about.slap_msgs:
        return Check(name, "ok", "can be imported")
    return Check(
        name,
        "problem",
        f"cannot be imported: {about.slap_msgs}",
        "pip install slap_ros (from a checkout: pip install -e .)."
        if about.embedded
        else "Run colcon build in the checkout, then source install/setup.bash.",
    )


def settings(about: RclpyStatus) -> Check:
    """The environment variables that decide which nodes find each other."""
    name = "ROS 2 settings"
    for fault in variables.faults():
        return Check(name, fault.status, fault.found, fault.advice)
    if not (about.embedded or about.error or variables.RANGE in os.environ):
        return Check(name, "warning", variables.described(), variables.RANGE_HINT)
    return Check(name, "ok", variables.described())
