# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of acquiring skills: functions of plain data, run anywhere in any order."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from slap_ros.acquisition.curriculum.after_shortcuts import AfterShortcuts, ShortcutsChoice
from slap_ros.acquisition.curriculum.initiation_states import InitiationRecord, InitiationStates
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.continued_training import continue_training, earlier_starts
from slap_ros.acquisition.training.judges import (
    Judge,
    JudgeElsewhere,
    JudgeHere,
    judge_until_closed,
)
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_env import Initiation
from slap_ros.acquisition.training.skill_training import SkillTraining
from slap_ros.acquisition.training.validation import SkillTrials
from slap_ros.acquisition.training.warm_start import TriedStart, WarmStart
from slap_ros.core import Domain, MakeVectorWorld
from slap_ros.errors import InvalidStateError
from slap_ros.learning.divided_worlds import divided_worlds
from slap_ros.learning.linked_process import linked_process
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.skills.reward import SkillReward
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_library import load_skill


@dataclass(frozen=True)
class LearningJob:
    """A round of training of one skill, as data that other processes can be sent.

    Args:
        source: Source of the tasks.
        operator: Name of the skill's operator.
        number: Number of the round, from 0.
        initiations: Initiation states of rollouts on training tasks, where episodes begin.
        fresh: Initiation states of rollouts on tasks that training never sees, where checkpoints
            are judged from.
        settings: All hyper-parameters of the curriculum.
        folder: Folder in which the skill is learned.
        warm_start: Known skill that the first round begins with; None for no warm start.
        attempt: Number of times that the skill was learned from scratch before.
        tried: Known skills that were tried before the first round, for the record.
        needed: Success rate that the goal needs, as in
            :class:`~slap_ros.acquisition.training.skill_training.SkillTraining`.
        continued: Folder of the skill's training for an earlier goal, which goes on; None where
            training begins.
    """

    source: TaskSource
    operator: str
    number: int
    initiations: InitiationStates
    fresh: InitiationStates
    settings: AcquisitionSettings
    folder: Path
    warm_start: WarmStart | None = None
    attempt: int = 0
    tried: tuple[TriedStart, ...] = ()
    needed: float = math.inf
    continued: Path | None = None

    @property
    def segment_steps(self) -> int:
        """Environment steps between two judgements."""
        return self.settings.segment_steps(horizon_of(self.source.make_domain()))

    @property
    def steps(self) -> int:
        """Environment steps of the round at most."""
        return self.settings.segments(horizon_of(self.source.make_domain())) * self.segment_steps


def carry_out(source: TaskSource, index: int, skills: Mapping[str, str]) -> dict[str, Any]:
    """Carry out the plan for one task.

    Args:
        source: Source of the tasks.
        index: Index of the task.
        skills: Folders of the skills at hand, by operator name.

    Returns:
        A :class:`~slap_ros.acquisition.curriculum.plan_rollout.PlanRollout` as JSON.
    """
    domain = source.make_domain()
    learned = {name: _skill(folder, domain) for name, folder in skills.items()}
    task = source.task(index)
    found = roll_out(domain, task, index, source.operators(), learned, source.rewards())
    return found.as_json()


def learn(job: LearningJob, cores: int = 1) -> dict[str, Any]:
    """Learn one skill for one round.

    Args:
        job: Round of training to carry out.
        cores: Number of cores that the job may use; from two on, other processes judge checkpoints
            and step half of the worlds, and large critics are divided. The result does not depend
            on it.

    Returns:
        The :class:`~slap_ros.acquisition.training.skill_training.Round` as JSON, with the number
        of start states that the world refused, under ``refused``.

    Raises:
        ChildProcessError: One of these processes has ended.
        InvalidParameterError: The folder is damaged.
        InvalidStateError: The world refuses all states.
    """
    source, settings = job.source, job.settings
    domain = source.make_domain()
    reward = _reward(source, job.operator, domain)
    accepted, refused = _starts(job, domain)
    policy = job.warm_start.policy if job.warm_start is not None else None
    if job.continued is not None:
        continue_training(job.continued, job.folder)
        accepted += _earlier_starts(job.continued, domain, len(accepted), settings.rehearsal)
    with _judge(job, domain, cores) as judge, _worlds(job, domain, cores) as make_worlds:
        training = SkillTraining(
            domain,
            reward,
            horizon_of(domain),
            settings,
            source.seed,
            job.folder,
            make_worlds,
            job.attempt,
            job.needed,
        )
        outcome = training.run(job.number, accepted, judge, policy)
    return {**asdict(outcome), "refused": refused}


def try_after_shortcuts(
    source: TaskSource, index: int, skills: Mapping[str, str], shortcuts: ShortcutsChoice
) -> list[dict[str, Any]]:
    """Carry out the skills that a search for a plan with shortcuts tries after them.

    Args:
        source: Source of the tasks.
        index: Index of the task.
        skills: Folders of the skills at hand, by operator name.
        shortcuts: Shortcuts to plan with.

    Returns:
        Each as a :class:`~slap_ros.acquisition.curriculum.plan_rollout.PlanRollout` as JSON.
    """
    domain = source.make_domain()
    acquired = {name: load_skill(Path(folder), domain) for name, folder in skills.items()}
    after = AfterShortcuts(shortcuts, acquired, source.rewards())
    return [found.as_json() for found in after.roll_out(domain, source.task(index), index)]


@contextmanager
def _judge(job: LearningJob, domain: Domain, cores: int) -> Iterator[Judge]:
    """The judge of the checkpoints of a round."""
    if cores == 1:
        yield JudgeHere(_trials(job, domain))
        return
    with linked_process(_judge_until_closed, job) as link:
        yield JudgeElsewhere(link)


@contextmanager
def _worlds(job: LearningJob, domain: Domain, cores: int) -> Iterator[MakeVectorWorld]:
    """The function that makes the worlds in which a round is learned."""
    if cores == 1:
        yield domain.make_vector_world
        return
    with divided_worlds(domain, job.source.make_domain) as make_worlds:
        yield make_worlds


def _judge_until_closed(link: Connection, job: LearningJob) -> None:
    judge_until_closed(link, _trials(job, job.source.make_domain()))


def _trials(job: LearningJob, domain: Domain) -> SkillTrials:
    """Trials from states of fresh tasks; where there are none, from those that are learned from."""
    judged, _ = _accepted(job.source, domain, job.fresh.all[: job.settings.judged])
    reward = _reward(job.source, job.operator, domain)
    return SkillTrials(domain, reward, judged or _starts(job, domain)[0], horizon_of(domain))


def _starts(job: LearningJob, domain: Domain) -> tuple[list[Initiation], int]:
    """The states to learn from that the world accepts, and how many it refuses.

    Raises:
        InvalidStateError: It refuses all.
    """
    starts = job.initiations.with_rehearsal(job.settings.rehearsal)
    accepted, refused = _accepted(job.source, domain, starts)
    if not accepted:
        raise InvalidStateError(
            f"{domain.name} refuses all {len(starts)} states in which {job.operator} is to be "
            "learned"
        )
    return accepted, refused


def _earlier_starts(earlier: Path, domain: Domain, new: int, rehearsal: float) -> list[Initiation]:
    """States of an earlier goal, as many beside new ones as are rehearsed of these."""
    return earlier_starts(earlier, domain.types_by_name, round(new * rehearsal / (1.0 - rehearsal)))


def try_known(
    source: TaskSource,
    operator: str,
    starts: Sequence[WarmStart],
    states: Sequence[InitiationRecord],
) -> list[float]:
    """How well known skills do in place of a new one.

    Args:
        source: Source of the tasks.
        operator: Name of the new skill's operator.
        starts: Warm starts to try.
        states: Initiation states of the new skill, one per episode.

    Returns:
        The success rate of each known skill; 0 where the world refuses all states.
    """
    domain = source.make_domain()
    accepted, _ = _accepted(source, domain, states)
    if not accepted:
        return [0.0] * len(starts)
    trials = SkillTrials(domain, _reward(source, operator, domain), accepted, horizon_of(domain))
    return [trials.success(start.policy.mean) for start in starts]


def vacuity(
    source: TaskSource, operator: str, fresh: Sequence[InitiationRecord], most: int
) -> dict[str, Any]:
    """How well constant and random actions do what a skill does.

    Args:
        source: Source of the tasks.
        operator: Name of the skill's operator.
        fresh: Initiation states of the skill on fresh tasks.
        most: Number of these states that are used at most, the first ones.

    Returns:
        The :class:`~slap_ros.acquisition.training.validation.Vacuity` as JSON.
    """
    domain = source.make_domain()
    reward = _reward(source, operator, domain)
    begun, _ = _accepted(source, domain, fresh[:most])
    trials = SkillTrials(domain, reward, begun, horizon_of(domain))
    return asdict(trials.vacuity(np.random.default_rng(source.seed)))


def horizon_of(domain: Domain) -> int:
    """Environment steps of a learned skill in a domain."""
    assert domain.acquisition is not None
    return domain.acquisition.horizon


def _skill(folder: str, domain: Domain) -> LearnedSkill:
    return load_skill(Path(folder), domain).in_domain(domain)


def _reward(source: TaskSource, operator: str, domain: Domain) -> SkillReward:
    (lifted,) = (one for one in source.operators() if one.name == operator)
    return SkillReward(lifted, source.rewards()[operator], learner_interface(domain))


def _accepted(
    source: TaskSource, domain: Domain, records: Sequence[InitiationRecord]
) -> tuple[list[Initiation], int]:
    """The states that the world accepts, and how many it refuses."""
    accepted: list[Initiation] = []
    for index, names, data in records:
        layout = source.task(index).initial_state.layout
        objects = tuple(layout.object(name) for name in names)
        begun = Initiation(State(layout, np.array(data)), objects)
        try:
            domain.make_world(begun.state)
        except InvalidStateError:
            continue
        accepted.append(begun)
    return accepted, len(records) - len(accepted)
