# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The metrics of runs: how a run went, and how each of its options went.

A metric that the messages should give and do not is None, with the reason in
``RunMetrics.unknown``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from slap_ros.errors import ErrorCode

OPERATOR, SHORTCUT, UNKNOWN = "operator", "shortcut", "unknown"  # kinds of options


@dataclass(frozen=True)
class OptionMetrics:
    """One option as it was executed."""

    name: str  # name of the operator or shortcut
    kind: str  # operator or shortcut; unknown without the plan
    objects: tuple[str, ...]
    steps: int  # environment steps
    outcome: str  # reached, failed, canceled or unfinished


@dataclass(frozen=True)
class RunMetrics:
    """One run. The order of the fields is that of reports and of ``--json``."""

    domain: str
    preset: str | None
    seed: int | None  # -1: the initial state was given explicitly
    index: int | None  # index of the task among those of the seed
    # The run was SOLVED and the goal atoms hold in its last state, as perceived; None: that is not
    # known, as atoms, goal or events were not recorded.
    success: bool | None
    plan_length: int | None  # environment steps
    shortcut_steps: int | None  # environment steps that shortcuts took, out of plan_length
    planning_seconds: float | None  # planning time of all plans together, s
    replans: int | None
    edges_rolled_out: int | None  # options simulated for all plans
    error_code: ErrorCode
    error_msg: str
    options: tuple[OptionMetrics, ...]
    planner: str | None  # planner of the first plan, as library and samples are; empty: no plan
    library: str | None  # digest of the shortcuts that it knew
    samples: int | None  # attempts of a shortcut in its model
    # How many times as long as the shortest the first plan is at most; None: nothing is proven, or
    # the plan was not recorded, which alone is in ``unknown``.
    bound: float | None
    unknown: Mapping[str, str] = field(default_factory=dict)  # why a metric is None, by metric

    @property
    def outcome(self) -> str:
        """How the run ended, in words."""
        if self.success is None:
            return f"not known whether solved: {self.error_msg}"
        return "solved" if self.success else f"not solved: {self.error_msg}"

    def as_json(self) -> dict[str, Any]:
        """The JSON object of ``--json``, keys in the order of the fields."""
        return asdict(self) | {
            "error_code": int(self.error_code),
            "unknown": dict(self.unknown),
            "options": [
                asdict(option) | {"objects": list(option.objects)} for option in self.options
            ],
        }


def known(value: float | str | None, form: str = "") -> str:
    """A metric as text, by a format specification, or ``unknown``."""
    return "unknown" if value is None else format(value, form)
