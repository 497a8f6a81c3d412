# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators of several language models, with which A* plans (LG-SAIL Tables 5 and 6)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from slap_ros.api.left_out import Tell
from slap_ros.studies.lg_sail.planning_ablation import (
    MEASURED,
    SEARCH,
    PlanningOptions,
    Plans,
    prepare_asking,
    summary,
)
from slap_ros.studies.study import PreparedStudy, Study, not_made

__all__ = ["MEASURED", "STUDY"]


@dataclass(frozen=True, kw_only=True)
class SeveralModelsOptions(PlanningOptions):
    """Options of this study."""

    plans: Plans = 100


def prepare(options: SeveralModelsOptions, _: Tell) -> PreparedStudy:
    """Open the models.

    Raises:
        InvalidParameterError: A model is named twice.
        InvalidCassetteError: The cassette was not recorded from a model.
    """
    asked = prepare_asking(options, [SEARCH], {})
    return replace(asked, make=lambda runner: replace(asked.make(runner), study="models"))


STUDY = Study(
    "models",
    help="LG-SAIL Tables 5 and 6: operators of several language models; A* plans with them.",
    example="slap study models stow_hammer --model NAME",
    options=SeveralModelsOptions,
    prepare=prepare,
    summary=summary,
    figures=(
        not_made(
            "LG-SAIL Tables 5 and 6",
            "operators of other language models",
            "operators 79 to 98%",
            "needs language models",
        ),
    ),
    costs="attempts",
)
