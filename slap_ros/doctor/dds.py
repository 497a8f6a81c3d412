# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether two nodes in two processes find each other here and exchange messages."""

from __future__ import annotations

import json
import re
from contextlib import ExitStack
from time import monotonic
from typing import Any
from uuid import uuid4

from slap_ros.doctor import settings
from slap_ros.doctor.check import Check
from slap_ros.doctor.processes import PROBE, ProcessResult, finished, started
from slap_ros.doctor.ros import RclpyStatus

NAME = "DDS between two processes"
LIMIT_S = 40.0  # for everything, on a busy machine too
ENDING_S = 1.0  # of it for the answering process to end
SLOW_DISCOVERY_S = 3.0
SLOW_ROUND_TRIP_S = 0.02
# CycloneDDS's own lines: time, thread, program, then what was wrong.
_CYCLONE = re.compile(r"^\d+\.\d+ \[\d+\]\s+\S+?: (.+)$", re.MULTILINE)


def conversation(about: RclpyStatus) -> Check:
    """Start two nodes and let them talk, with the environment as it is."""
    if about.error:
        return Check(NAME, "problem", "not tried, without rclpy", "See ROS 2.")
    for fault in settings.impossible():
        return Check(NAME, "problem", f"not tried: {fault.found}", fault.advice)
    asked, answered = _converse()
    used = settings.described()
    for outcome in (asked, answered):
        if outcome.code != 0:
            return Check(NAME, "problem", f"{_cause(outcome)} ({used})", settings.advice())
    here, there = _report(asked), _report(answered)
    if here["first"] is None or here["median"] is None:
        found = f"two nodes on this machine did not reach each other ({used})"
        return Check(NAME, "problem", found, settings.advice())
    discovery_s = here["first"] - max(here["ready"], there["ready"])
    return _measured(max(discovery_s, 0.0), here["median"], here["trips"], used)


def _converse() -> tuple[ProcessResult, ProcessResult]:
    """How the asking and the answering process ended; both are gone."""
    deadline, token = monotonic() + LIMIT_S, uuid4().hex[:8]
    with ExitStack() as stack:
        answering = stack.enter_context(started(["-m", PROBE, "answer", token]))
        asking = stack.enter_context(started(["-m", PROBE, "ask", token]))
        asked = finished(asking, deadline - ENDING_S - monotonic())
        return asked, finished(answering, deadline - monotonic())


def _report(outcome: ProcessResult) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(outcome.output.splitlines()[-1])
    return report


def _cause(outcome: ProcessResult) -> str:
    """CycloneDDS's own words where it has any: its exceptions say nothing."""
    said = _CYCLONE.findall(outcome.errors)
    return str(said[0]) if said else outcome.last_error


def _measured(discovery_s: float, round_trip_s: float, trips: int, used: str) -> Check:
    found = (
        f"found each other in {discovery_s * 1e3:.0f} ms; a round trip takes "
        f"{round_trip_s * 1e3:.1f} ms, median of {trips} ({used})"
    )
    if discovery_s > SLOW_DISCOVERY_S:
        return Check(NAME, "warning", found, f"Discovery is slow. {settings.advice()}")
    if round_trip_s > SLOW_ROUND_TRIP_S:
        advice = "Messages are slow: see what else keeps this machine busy."
        return Check(NAME, "warning", found, advice)
    return Check(NAME, "ok", found)
