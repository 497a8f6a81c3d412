# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environment variables that decide which nodes find each other."""

from __future__ import annotations

import os
from dataclasses import dataclass

import psutil

from slap_ros.doctor.check import Status

DOMAIN_ID, RANGE, URI = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "CYCLONEDDS_URI"
REPORTED = (DOMAIN_ID, RANGE, "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", URI)
MAX_DOMAIN_ID = 232  # DDS has no ports for more
# Domain N uses ports from 7400 + 250 N; from 32768 on Linux gives them to any program that asks.
SAFE_DOMAIN_IDS = range(102)
UNSAFE_DOMAIN_IDS = range(102, 215)
RANGES = ("LOCALHOST", "SUBNET", "SYSTEM_DEFAULT", "OFF")


@dataclass(frozen=True)
class SettingFault:
    """A setting that keeps nodes from finding each other, or may."""

    status: Status
    found: str
    advice: str


def described() -> str:
    """The variables and their values."""
    return ", ".join(f"{name} {_value(name)}" for name in REPORTED if name in os.environ) or (
        f"{DOMAIN_ID}, {RANGE} and {URI} are not set"
    )


def faults() -> list[SettingFault]:
    """What is wrong with the values, as far as can be seen without trying."""
    return [*_domain_faults(), *_range_faults()]


def advice() -> str:
    """What to do when nodes do not find each other."""
    for fault in faults():
        if fault.status == "problem":
            return fault.advice
    if os.environ.get(URI):
        interfaces = ", ".join(sorted(psutil.net_if_addrs()))
        return f"Correct {URI} or unset it; the network interfaces here are {interfaces}."
    return (
        "Let a firewall pass UDP from 7400 + 250 times ROS_DOMAIN_ID upwards on the loopback "
        f"interface, and set {RANGE}=LOCALHOST if all nodes run on this machine."
    )


def _value(name: str) -> str:
    value = " ".join(os.environ[name].split())
    return value if len(value) <= 60 else f"{value[:59]}…"


def _domain_faults() -> list[SettingFault]:
    text = os.environ.get(DOMAIN_ID, "").strip() or "0"
    safe = f"Set {DOMAIN_ID} to a number from 0 to {SAFE_DOMAIN_IDS[-1]}, the same for all nodes."
    # int() refuses some characters that isdecimal() takes for digits, hence isascii().
    if not (text.isascii() and text.isdecimal()) or int(text) > MAX_DOMAIN_ID:
        found = f"{DOMAIN_ID} is {text!r}, not a number from 0 to {MAX_DOMAIN_ID}"
        return [SettingFault("problem", found, safe)]
    if int(text) in UNSAFE_DOMAIN_IDS:
        found = f"the ports of {DOMAIN_ID} {text} may be taken by other programs"
        return [SettingFault("warning", found, safe)]
    return []


def _range_faults() -> list[SettingFault]:
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return []  # it overrides the range
    text = os.environ.get(RANGE, "").strip().upper() or RANGES[0]
    advice = f"Set {RANGE} to LOCALHOST for nodes on this machine, or to SUBNET for several."
    if text not in RANGES:
        return [
            SettingFault("problem", f"{RANGE} is {text!r}, none of {', '.join(RANGES)}", advice)
        ]
    if text == "OFF":
        return [SettingFault("problem", f"{RANGE} is OFF: no node finds another", advice)]
    return []
