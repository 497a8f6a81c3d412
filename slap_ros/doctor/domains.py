# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains that other distributions registered: can they be made?"""

from __future__ import annotations

from slap_ros.doctor.check import Check
from slap_ros.doctor.processes import run_python
from slap_ros.domains import domain_names
from slap_ros.domains.registry import OURS, registrations

MAKE_LIMIT_S = 60.0  # a simulator takes its time when the disk is cold


def others() -> Check:
    """Each is made in a process of its own: a broken one may take Python down, or never end."""
    names = [name for name in domain_names() if name not in OURS]
    broken = [f"{name}: {error}" for name in names if (error := _error(name))]
    broken += [f"entry points of {unreadable}" for unreadable in registrations().unreadable]
    if broken:
        advice = "Repair or uninstall what is named; everything else works."
        return Check("Domains", "warning", "; ".join(broken), advice)
    if not names:
        return Check("Domains", "ok", "none but ours")
    return Check("Domains", "ok", f"{', '.join(names)}, of other distributions")


def _error(name: str) -> str:
    """Why a domain cannot be made; empty where it can."""
    code = f"from slap_ros.domains import get_domain; get_domain({name!r})"
    outcome = run_python(["-c", code], MAKE_LIMIT_S)
    return "" if outcome.code == 0 else outcome.last_error
