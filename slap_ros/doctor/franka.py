# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Franka arm, and the way to it: looked at without moving it."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from slap_ros.doctor.check import Check, Status
from slap_ros.errors import InvalidParameterError, SlapError
from slap_ros.files import read_text
from slap_ros.robot.franka.arm import ArmProbe, ArmReading, FrankaArm, FrankaSettings
from slap_ros.robot.franka.installed import INSTALL
from slap_ros.robot.franka.limits import FRANKA

ANSWERS = 50  # commands by which the network is timed
QUICK_S, SLOW_S = 0.001, 0.005  # s: within the control's period; beyond what it forgives
NEAR = 0.1  # rad, of a joint to its limit
REALTIME = Path("/sys/kernel/realtime")  # has a 1 where the kernel is a real-time one


def robot_address(text: str) -> str:
    """The address in ``ip=ADDRESS``.

    Raises:
        InvalidParameterError: There is none, or there is more than that.
    """
    name, _, address = text.partition("=")
    if name != "ip" or not address or "," in address:
        raise InvalidParameterError(f"--robot is ip=ADDRESS, such as ip=172.16.0.2, not {text!r}")
    return address


def examine_robot(ip: str) -> list[Check]:
    """Look at everything that driving a Franka arm depends on; nothing moves.

    Args:
        ip: Address of the robot.
    """
    kernel = realtime_kernel()
    if find_spec("franky") is None:
        return [kernel, Check("franky", "problem", "not installed", INSTALL)]
    try:
        arm = FrankaArm(FrankaSettings(ip, FRANKA, realtime=False))
    except SlapError as error:
        return [kernel, Check("Robot", "problem", f"{error.code.name}: {error}")]
    try:
        probe = arm.probe(ANSWERS)
        return [kernel, *examine(arm.settings, arm.reading, probe)]
    except SlapError as error:
        return [kernel, Check("Robot", "problem", f"{error.code.name}: {error}")]
    finally:
        arm.close()


def realtime_kernel() -> Check:
    """Whether this machine can send a command each millisecond."""
    name, found = "Real-time kernel", f"{platform.system()} {platform.release()}"
    try:
        there = read_text(REALTIME).strip() == "1"
    except OSError:
        there = False
    if there or "PREEMPT_RT" in platform.version():
        return Check(name, "ok", found)
    advice = "Install a PREEMPT_RT kernel. With realtime=false, commands may come too late."
    return Check(name, "warning", f"{found}, not a real-time kernel", advice)


def examine(settings: FrankaSettings, reading: ArmReading, probe: ArmProbe) -> list[Check]:
    """The findings about an arm that answers.

    Args:
        settings: Limits and thresholds with which it is driven.
        reading: What was read of it last.
        probe: What it says of itself.
    """
    return [
        _mode(probe.mode),
        Check(
            "Protocol", "ok", f"the robot's is franky's; gripper version {probe.gripper_version}"
        ),
        _network(probe.answers_s),
        _gripper(probe.widest_gap),
        _joints(settings, reading.joints),
        Check(
            "Collision thresholds",
            "ok",
            f"{settings.collision_torque:g} Nm, {settings.collision_force:g} N, as a driver "
            "without collision_torque and collision_force sets them",
        ),
    ]


def _mode(mode: str) -> Check:
    if mode == "Idle":
        return Check("Robot", "ok", "it answers, and is idle")
    advice = "Release the stop, look at the arm, and recover in Desk or by franka_driver/recover."
    return Check("Robot", "problem", f"it answers, but its mode is {mode}", advice)


def _network(answers_s: Sequence[float]) -> Check:
    """How long the robot takes to answer."""
    middle, worst = median(answers_s), max(answers_s)
    status: Status = "ok" if worst <= QUICK_S else "warning" if middle <= SLOW_S else "problem"
    found = f"{1e3 * middle:.2f} ms to an answer, {1e3 * worst:.2f} ms at most"
    advice = "" if status == "ok" else "Use a cable without a switch, and quiet other programs."
    return Check("Network", status, found, advice)


def _gripper(widest: float) -> Check:
    if widest > 0.0:
        return Check("Gripper", "ok", f"homed, opens to {1e3 * widest:.0f} mm")
    return Check("Gripper", "problem", "not homed", "Home it in Desk: its fingers will move.")


def _joints(settings: FrankaSettings, joints: Sequence[float]) -> Check:
    """How far the joints are from their limits."""
    limits = settings.limits
    room = [
        min(q - low, high - q) for low, q, high in zip(limits.low, joints, limits.high, strict=True)
    ]
    joint = min(range(len(room)), key=room.__getitem__)
    found = f"joint {joint + 1} is nearest to its limit, {room[joint]:.2f} rad away"
    if room[joint] >= NEAR:
        return Check("Joint limits", "ok", found)
    status: Status = "warning" if room[joint] >= 0.0 else "problem"
    return Check("Joint limits", status, found, "Guide the arm away from it by hand.")
