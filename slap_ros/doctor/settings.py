# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environment variables that decide which nodes find each other."""

from __future__ import annotations

import os
import socket
from dataclasses import dataclass
from pathlib import Path

import psutil

from slap_ros.doctor.check import Status

DOMAIN_ID, RANGE, URI = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "CYCLONEDDS_URI"
LOCALHOST_ONLY = "ROS_LOCALHOST_ONLY"  # older than the range, and overrides it
SECURITY, STRATEGY, KEYSTORE = (
    "ROS_SECURITY_ENABLE",
    "ROS_SECURITY_STRATEGY",
    "ROS_SECURITY_KEYSTORE",
)
PEERS = "ROS_STATIC_PEERS"
REPORTED = (DOMAIN_ID, RANGE, LOCALHOST_ONLY, PEERS, URI, SECURITY, STRATEGY, KEYSTORE)
MAX_DOMAIN_ID = 232  # DDS has no ports for more
# Domain N uses ports from 7400 + 250 N; from 32768 on Linux gives them to any program that asks.
SAFE_DOMAIN_IDS = range(102)
UNSAFE_DOMAIN_IDS = range(102, 215)
RANGES = ("LOCALHOST", "SUBNET", "SYSTEM_DEFAULT", "OFF")
SAFE_DOMAIN = (
    f"Set {DOMAIN_ID} to a number from 0 to {SAFE_DOMAIN_IDS[-1]}, the same for all nodes."
)
WANTED_RANGE = f"Set {RANGE} to LOCALHOST for nodes on this machine, or to SUBNET for several."
# The nodes choose LOCALHOST by themselves, a sourced ROS 2's own tools do not.
RANGE_HINT = (
    f"nodes of slap_ros keep to this host, as {RANGE} is not set. Other terminals find them at "
    f"once after: export {RANGE}=LOCALHOST; ros2 daemon stop"
)


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
    return [*impossible(), *_domain_warnings(), *_off_faults(), *_strategy_warnings()]


def impossible() -> list[SettingFault]:
    """Values with which a node cannot start, or starts as if there were another."""
    return [*_domain_faults(), *_range_faults(), *_peer_faults(), *_keystore_faults()]


def is_open_to_others() -> bool:
    """Whether other hosts are to be found: not unless somebody asked for it."""
    if os.environ.get(LOCALHOST_ONLY) == "1":
        return False
    return _range() not in ("LOCALHOST", "OFF")


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
    # int() refuses some characters that isdecimal() takes for digits, hence isascii().
    if not (text.isascii() and text.isdecimal()) or int(text) > MAX_DOMAIN_ID:
        found = f"{DOMAIN_ID} is {text!r}, not a number from 0 to {MAX_DOMAIN_ID}"
        return [SettingFault("problem", found, SAFE_DOMAIN)]
    return []


def _domain_warnings() -> list[SettingFault]:
    text = os.environ.get(DOMAIN_ID, "").strip() or "0"
    if _domain_faults() or int(text) not in UNSAFE_DOMAIN_IDS:
        return []
    found = f"the ports of {DOMAIN_ID} {text} may be taken by other programs"
    return [SettingFault("warning", found, SAFE_DOMAIN)]


def _range() -> str:
    return os.environ.get(RANGE, "").strip() or RANGES[0]


def _range_faults() -> list[SettingFault]:
    if os.environ.get(LOCALHOST_ONLY) == "1" or _range() in RANGES:
        return []
    found = f"{RANGE} is {_range()!r}, none of {', '.join(RANGES)}"
    return [SettingFault("problem", found, WANTED_RANGE)]


def _peer_faults() -> list[SettingFault]:
    # With a name that it cannot resolve, CycloneDDS ends the process.
    for peer in filter(None, os.environ.get(PEERS, "").split(";")):
        try:
            socket.getaddrinfo(peer, None)
        except (OSError, UnicodeError):
            found = f"{PEERS} has {peer!r}, which is no address of a host"
            advice = f"Set {PEERS} to names or addresses with ';' between them, or unset it."
            return [SettingFault("problem", found, advice)]
    return []


def _off_faults() -> list[SettingFault]:
    if os.environ.get(LOCALHOST_ONLY) == "1" or _range() != "OFF":
        return []
    return [SettingFault("problem", f"{RANGE} is OFF: no node finds another", WANTED_RANGE)]


def _keystore_faults() -> list[SettingFault]:
    # rcl goes by these very words; embedded_ros refuses SROS 2 itself.
    if os.environ.get(SECURITY) != "true" or os.environ.get(STRATEGY) != "Enforce":
        return []
    keystore = os.environ.get(KEYSTORE, "")
    if keystore and Path(keystore, "enclaves").is_dir():
        return []
    found = f"{SECURITY} is true, but {KEYSTORE} is {keystore!r}, which is no keystore"
    return [SettingFault("problem", found, f"ros2 security create_keystore, or unset {SECURITY}.")]


def _strategy_warnings() -> list[SettingFault]:
    if os.environ.get(SECURITY) != "true" or os.environ.get(STRATEGY) == "Enforce":
        return []
    found = f"{SECURITY} is true, but nodes without keys run unprotected"
    return [SettingFault("warning", found, f"export {STRATEGY}=Enforce")]
