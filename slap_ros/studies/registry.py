# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All studies, and the figures of the papers that they make."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from slap_ros.studies.lg_sail import (
    acquisition,
    acquisition_ablation,
    closed_loop,
    demonstrations,
    imitation,
    induction,
    models,
    open_loop,
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
    curves,
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
    pruned,
    pruning,
    rivals,
    stochastic,
    table1,
    transfer,
)
from slap_ros.studies.study import PaperFigure, Study

STUDIES: Mapping[str, Study[Any]] = {
    study.name: study
    for study in (  # in the order in which help lists them
        dynamics.STUDY,
        generalisation.STUDY,
        goals.STUDY,
        pruning.STUDY,
        pruned.STUDY,
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
        open_loop.STUDY,
        closed_loop.STUDY,
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
        curves.STUDY,
        ablation.STUDY,
    )
}


def paper_figures() -> list[tuple[str, PaperFigure]]:
    """Every figure of the papers with the name of its study, in their order."""
    figures = [(study.name, figure) for study in STUDIES.values() for figure in study.figures]
    return sorted(figures, key=lambda pair: _place(pair[1].source))


def _place(source: str) -> tuple[bool, bool, int]:
    """SLAP before LG-SAIL, tables before pictures, then by number."""
    number = re.search(r"\d+", source)
    assert number is not None
    first = source.split(",")[0]
    return not source.startswith("SLAP"), "Fig." in first, int(number[0])
