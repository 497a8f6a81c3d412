# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP in a world with noise and drops (SLAP Table 6)."""

from __future__ import annotations

from slap_ros.api.left_out import Tell
from slap_ros.studies.slap import robustness
from slap_ros.studies.slap.robustness import (
    TABLE,
    PapersRow,
    RobustnessOptions,
    RobustnessStudy,
    summary,
)
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

MEASURED = f"""\
Plans are made as if nothing disturbed the world, and executed in a world with noise on actions,
drops, blocks of other sizes, masses and frictions, and towers that are not stacked well: the preset
`stochastic` ([what each number means](../presets.md#worlds-that-differ-from-the-planners-model)).
The planner sees sizes, and neither masses nor friction. It plans again after each divergence, up to
the limit given below. A task is solved if its goal holds in the world at the end.

{TABLE}"""
STOCHASTIC = RobustnessStudy(
    "stochastic",
    source="SLAP Table 6",
    title="A stochastic world",
    measured=MEASURED,
    papers=(PapersRow("pure_planning", 0.84, 293.6), PapersRow("slap", 0.92, 119.7)),
    preset="stochastic",
)


def prepare(options: RobustnessOptions, tell: Tell) -> PreparedStudy:
    """Open domain and libraries."""
    return robustness.prepare(STOCHASTIC, options, tell)


STUDY = Study(
    "stochastic",
    help="SLAP Table 6: success, length and replans where actions have noise and the hand drops "
    "things.",
    example="slap study stochastic obstacle_tower",
    options=RobustnessOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        PaperFigure(
            "SLAP Table 6",
            "a stochastic world",
            ("obstacle_tower",),
            {"": "success 84 → 92%; 293.6 → 119.7 steps"},
        ),
    ),
)
