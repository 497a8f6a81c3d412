# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What acquiring skills consists of: functions of plain data, run anywhere in any order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from slap_ros.acquisition.reward import SkillReward
from slap_ros.acquisition.rollouts import PlanRollout, Stage, StageEnd, initiation, roll_out
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.skill import LearnedSkill
from slap_ros.acquisition.skill_env import Initiation
from slap_ros.acquisition.skill_library import load_skill
from slap_ros.acquisition.skill_training import SkillTraining
from slap_ros.acquisition.task_source import TaskSource
from slap_ros.acquisition.validation import SkillTrials
from slap_ros.core import Domain
from slap_ros.errors import InvalidStateError
from slap_ros.learning.mlp_policy import MlpPolicy

InitiationRecord = tuple[int, tuple[str, ...], tuple[float, ...]]  # task, objects, state


def carry_out(source: TaskSource, index: int, skills: Mapping[str, str]) -> dict[str, Any]:
    """Carry out the plan for one task.

    Args:
        source: Of tasks.
        index: Of the task.
        skills: Folders of the skills at hand, by operator name.

    Returns:
        A :class:`~slap_ros.acquisition.rollouts.PlanRollout` as JSON.
    """
    domain = source.make_domain()
    learned = {name: _skill(folder, domain) for name, folder in skills.items()}
    task = source.task(index)
    return roll_out(domain, task, index, source.operators(), learned).as_json()


def learn(
    source: TaskSource,
    operator: str,
    number: int,
    starts: Sequence[InitiationRecord],
    fresh: Sequence[InitiationRecord],
    settings: AcquisitionSettings,
    folder: str,
    beginning: MlpPolicy | None,
) -> dict[str, Any]:
    """Learn one skill for one round.

    Args:
        source: Of tasks.
        operator: Name of the skill's.
        number: Of the round.
        starts: Where episodes begin.
        fresh: Where checkpoints are judged from.
        settings: All hyper-parameters.
        folder: Where the skill is learned.
        beginning: The policy of another skill that the first round begins with.

    Returns:
        The :class:`~slap_ros.acquisition.skill_training.Round` as JSON, with the number of start
        states that the world refused, under ``refused``.

    Raises:
        InvalidParameterError: The folder is damaged.
        InvalidStateError: The world refuses all states.
    """
    domain = source.make_domain()
    (lifted,) = (one for one in source.operators() if one.name == operator)
    reward = SkillReward(lifted, source.rewards()[operator])
    training = SkillTraining(
        domain, reward, horizon_of(domain), settings, source.seed, Path(folder)
    )
    accepted, refused = _accepted(source, domain, starts)
    judged, _ = _accepted(source, domain, fresh)
    if not accepted:
        raise InvalidStateError(
            f"{domain.name} refuses all {len(starts)} states in which {operator} is to be learned"
        )
    outcome = training.run(number, accepted, judged or accepted, beginning)
    return {**asdict(outcome), "refused": refused}


def vacuity(
    source: TaskSource, operator: str, fresh: Sequence[InitiationRecord], most: int
) -> dict[str, Any]:
    """How well constant and random actions do what a skill does.

    Args:
        source: Of tasks.
        operator: Name of the skill's.
        fresh: Where it begins.
        most: Of these states, the first.

    Returns:
        The :class:`~slap_ros.acquisition.validation.Vacuity` as JSON.
    """
    domain = source.make_domain()
    (lifted,) = (one for one in source.operators() if one.name == operator)
    reward = SkillReward(lifted, source.rewards()[operator])
    begun, _ = _accepted(source, domain, fresh[:most])
    trials = SkillTrials(domain, reward, begun, horizon_of(domain))
    return asdict(trials.vacuity(np.random.default_rng(source.seed)))


def horizon_of(domain: Domain) -> int:
    """Environment steps of a learned skill."""
    assert domain.acquisition is not None
    return domain.acquisition.horizon


def initiation_record(rollout: PlanRollout, stage: Stage) -> InitiationRecord:
    """Where a stage's skill began, as data."""
    return rollout.task, stage.objects, stage.state


def _skill(folder: str, domain: Domain) -> LearnedSkill:
    return load_skill(Path(folder), domain).in_domain(domain)


def _accepted(
    source: TaskSource, domain: Domain, records: Sequence[InitiationRecord]
) -> tuple[list[Initiation], int]:
    """The states that the world accepts, and how many it refuses."""
    accepted: list[Initiation] = []
    for index, objects, state in records:
        stage = Stage("", objects, state, StageEnd.DONE.value, 0)
        begun = initiation(source.task(index), stage)
        try:
            domain.make_world(begun.state)
        except InvalidStateError:
            continue
        accepted.append(begun)
    return accepted, len(records) - len(accepted)
