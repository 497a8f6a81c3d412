# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP where the top block is never detected (SLAP Table 6, D.4)."""

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
The highest block of each task is hidden: it stands where it stands, and no sensor detects it, for
the whole task. So it is not in the states that are planned from, nor in the planner's model. A hand
feels what it holds: a hidden block that is grasped is known as long as it is held, and then for as
long as perception remembers things. The planner plans again after each divergence, and where it
finds no plan for what it sees, up to the limit given below. A task is solved if the planner says so
and its goal holds in the world.

{TABLE}"""
OCCLUDED = RobustnessStudy(
    "occluded",
    source="SLAP Table 6 and D.4",
    title="A block that is not detected",
    measured=MEASURED,
    papers=(PapersRow("pure_planning", 0.02), PapersRow("slap", 0.78)),
    hides_top=True,
)


def prepare(options: RobustnessOptions, tell: Tell) -> PreparedStudy:
    """Open domain and libraries."""
    return robustness.prepare(OCCLUDED, options, tell)


STUDY = Study(
    "occluded",
    help="SLAP Table 6: success, length and replans where the top block is never detected.",
    example="slap study occluded obstacle_tower",
    options=RobustnessOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        PaperFigure(
            "SLAP Table 6, D.4",
            "a top block that is hidden",
            ("obstacle_tower",),
            {"": "success 2 → 78%"},
        ),
    ),
)
