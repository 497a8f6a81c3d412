# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pure planning and SLAP in another physics than the planner's (SLAP Tables 7 and 8)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from slap_ros.api.command_options import CommandOption
from slap_ros.api.left_out import Tell
from slap_ros.domains import get_domain
from slap_ros.studies.slap import robustness
from slap_ros.studies.slap.library_rows import open_library
from slap_ros.studies.slap.robustness import (
    TABLE,
    PapersRow,
    RobustnessOptions,
    RobustnessStudy,
    described,
    renamed_way,
    summary,
)
from slap_ros.studies.study import PaperFigure, PreparedStudy, Study

TRAINED = "slap_trained_perturbed"  # the approach with libraries that were trained in such worlds
MEASURED = f"""\
Plans are made as if nothing disturbed the world, and executed in a world that differs more than in
[the study before](stochastic_obstacle_tower.md): the preset `perturbed` ([what each number
means](../presets.md#worlds-that-differ-from-the-planners-model)). The planner sees sizes, and
neither masses nor friction. It plans again after each divergence, up to the limit given below. A
task is solved if its goal holds in the world at the end. Libraries "trained perturbed" were trained
in such worlds; the others were trained without disturbances.

{TABLE}"""
PERTURBED = RobustnessStudy(
    "perturbed",
    source="SLAP Tables 7 and 8",
    title="Another physics than in planning",
    measured=MEASURED,
    papers=(
        PapersRow("pure_planning", 0.65),
        PapersRow("slap", 0.78),
        PapersRow(TRAINED, 0.86),
    ),
    preset="perturbed",
)


@dataclass(frozen=True, kw_only=True)
class PerturbedOptions(RobustnessOptions):
    """Options of this study."""

    trained: Annotated[
        list[Path] | None,
        CommandOption(
            "Folder of a library that was trained with `--preset perturbed`. May be repeated.",
            metavar="FOLDER",
        ),
    ] = None


def prepare(options: PerturbedOptions, tell: Tell) -> PreparedStudy:
    """Open domain and libraries, with those that were trained in perturbed worlds."""
    domain = get_domain(options.domain, options.preset or PERTURBED.preset)
    trained = [
        one for folder in options.trained or () if (one := open_library(folder, domain, tell))
    ]
    return robustness.prepare(
        PERTURBED,
        options,
        tell,
        [renamed_way(one, options.samples, TRAINED) for one in trained],
        {"trained_perturbed": described(trained)} if trained else {},
        {"trained": options.trained},
    )


STUDY = Study(
    "perturbed",
    help="SLAP Tables 7, 8: success, length and replans in another physics than the planner's.",
    example="slap study perturbed obstacle_tower --trained runs/perturbed",
    options=PerturbedOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        PaperFigure(
            "SLAP Tables 7 and 8",
            "another physics than in planning",
            ("obstacle_tower",),
            {"": "65 → 78%, trained again 86%"},
        ),
    ),
)
