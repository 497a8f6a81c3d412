# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The records of how a library of skills was acquired: figures by name, in its JSON files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState, SkillProgress
from slap_ros.acquisition.curriculum.known_or_learned import KnownOrLearned
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.skill_selection import NO_PROGRESS
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.versions import processor, versions


def skill_record(
    progress: SkillProgress,
    vacuity: Mapping[str, Any] | None,
    seed: int,
    compared: KnownOrLearned | None,
) -> dict[str, Any]:
    """The record of a skill that was trained.

    Args:
        progress: Progress of the skill in the end.
        vacuity: Vacuity of the skill, how well blind policies do, as JSON; None where no fresh task
            has come to the skill.
        seed: Seed of the curriculum.
        compared: Known skill that the training began with, beside what was learned from it; None
            where it began with random weights.
    """
    beginning = {} if compared is None else {"beside_its_beginning": compared.as_json()}
    known = compared is not None and compared.known_stays
    return {
        "success": compared.known if compared is not None and known else progress.success,
        "vacuity": vacuity,
        "steps": progress.steps,
        "rounds": progress.rounds,
        "attempts": progress.attempt + 1,
        "seed": seed,
        "began_with": progress.began_with,
        **beginning,
    }


def library_record(
    source: TaskSource,
    settings: Mapping[str, Any],
    state: CurriculumState,
    ended: str,
    fresh: Sequence[PlanRollout],
) -> dict[str, Any]:
    """The record of a library.

    Args:
        source: Source of the tasks.
        settings: All hyper-parameters of the curriculum, as JSON.
        state: State of the curriculum in the end.
        ended: Reason why the curriculum is over, in words.
        fresh: Rollouts on tasks that training never saw.
    """
    return {
        "preset": source.domain.preset,
        "goal": source.goal,
        "seed": source.seed,
        "ended": ended,
        "left": state.not_trained if ended == NO_PROGRESS else {},
        "progress": state.task_progress,
        "progress_steps": state.progress_steps,
        "progress_on_fresh_tasks": fmean(rollout.progress for rollout in fresh),
        "steps": state.steps,
        "settings": settings,
        "versions": dict(versions()),
        "processor": processor(),
    }
