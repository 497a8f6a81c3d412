# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All studies, and those figures of the papers that none of them makes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from slap_ros.studies.lg_sail import (
    acquisition,
    acquisition_ablation,
    demonstrations,
    imitation,
    induction,
    models,
    planning_ablation,
    progress,
    replanning,
    retrieval,
    reward_ablation,
    sequence,
    vacuity,
    warm_start,
)
from slap_ros.studies.slap import (
    ablation,
    camera,
    dynamics,
    generalisation,
    goals,
    learners,
    noisy_predicates,
    occluded,
    perception,
    perturbed,
    planning_time,
    possible_savings,
    pruning,
    rivals,
    stochastic,
    table1,
    transfer,
)
from slap_ros.studies.study import PaperFigure, Study, not_made

STUDIES: Mapping[str, Study[Any]] = {
    study.name: study
    for study in (  # in the order in which help lists them
        dynamics.STUDY,
        generalisation.STUDY,
        goals.STUDY,
        pruning.STUDY,
        possible_savings.STUDY,
        perception.STUDY,
        noisy_predicates.STUDY,
        stochastic.STUDY,
        occluded.STUDY,
        perturbed.STUDY,
        planning_time.STUDY,
        transfer.STUDY,
        camera.STUDY,
        demonstrations.STUDY,
        vacuity.STUDY,
        acquisition.STUDY,
        replanning.STUDY,
        progress.STUDY,
        imitation.STUDY,
        warm_start.STUDY,
        acquisition_ablation.STUDY,
        retrieval.STUDY,
        sequence.STUDY,
        induction.STUDY,
        planning_ablation.STUDY,
        models.STUDY,
        reward_ablation.STUDY,
        table1.STUDY,
        rivals.STUDY,
        learners.STUDY,
        ablation.STUDY,
    )
}
WITHOUT_STUDY = (
    not_made(
        "LG-SAIL Fig. 8", "a real robot", "0.8 and 1.0 of 10 trials", "no robot was available"
    ),
)


def paper_figures() -> list[tuple[str, PaperFigure]]:
    """Every figure of the papers with the name of its study, which may be empty, in their order."""
    return sorted(_figures(), key=lambda pair: _place(pair[1].source))


def _figures() -> Iterator[tuple[str, PaperFigure]]:
    for study in STUDIES.values():
        yield from ((study.name, figure) for figure in study.figures)
    yield from (("", figure) for figure in WITHOUT_STUDY)


def _place(source: str) -> tuple[bool, bool, int]:
    """SLAP before LG-SAIL, tables before pictures, then by number."""
    number = re.search(r"\d+", source)
    assert number is not None
    first = source.split(",")[0]
    return not source.startswith("SLAP"), "Fig." in first, int(number[0])
