# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training a library: explore, rank, learn, keep what shortens plans, and again (SLAP §4.2).

Every result is kept in a work folder, so that the same command continues where it was
interrupted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from statistics import fmean
from typing import Any, TypeVar

from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import Workers
from slap_ros.shortcuts.candidate_groups import CandidateGroup, other_problems, rank
from slap_ros.shortcuts.demonstrations import ShortcutDemonstration
from slap_ros.shortcuts.exploration_result import ExplorationResult, mean_operator_steps
from slap_ros.shortcuts.jobs import mean_length
from slap_ros.shortcuts.kept_shortcuts import KeptShortcuts
from slap_ros.shortcuts.learning_attempt import (
    LearningAttempt,
    StagedAttempt,
    learn,
    learn_first_stage,
)
from slap_ros.shortcuts.progress import Progress
from slap_ros.shortcuts.settings import ENOUGH_SUCCESS, TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.shortcuts.shortcut_record import with_demonstrations, with_origin
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.training_callback import TrainingCallback
from slap_ros.shortcuts.training_steps import TrainingSteps
from slap_ros.shortcuts.work_folder import attempt_folder
from slap_ros.versions import processor, versions

Result = TypeVar("Result")


@dataclass
class Training:
    """One training of a library.

    Args:
        distribution: Distribution of the tasks that the shortcuts are for.
        settings: All hyper-parameters of the training.
        folder: Work folder of the training; see :mod:`slap_ros.shortcuts.work_folder`.
        workers: Workers that run the jobs.
        callback: Callback that receives the events of the training.
        kept: Shortcuts of an earlier training, which are options like any other in this one, and
            part of the library that it makes.
    """

    distribution: TaskDistribution
    settings: TrainingSettings
    folder: Path
    workers: Workers
    callback: TrainingCallback
    kept: tuple[Shortcut, ...] = ()
    _shortcuts: list[Shortcut] = field(default_factory=list, init=False)
    _validation: list[int] = field(default_factory=list, init=False)  # tasks that have a plan
    _spent: int = field(default=0, init=False)  # environment steps of exploring and learning

    def __post_init__(self) -> None:
        self._shortcuts.extend(self.kept)
        self._work = WorkFolder(self.folder)
        self._steps = TrainingSteps(
            self.distribution,
            self.settings,
            self._work,
            self.workers,
            self.callback,
            KeptShortcuts(self.kept, self.settings.sampling),
        )

    def run(self) -> ShortcutLibrary:
        """Train until nothing else is worth learning, or go on where an earlier run ended.

        Raises:
            ChildProcessError: A process that stepped environments has ended.
            InvalidParameterError: The folder has a training with other settings, or is damaged; or
                the settings want more tasks than there are for a use.
            UnsolvableError: No validation task has a plan, or no task to be explored has one.
        """
        self._steps.require_tasks()
        self._require_same_settings()
        alone = self._steps.validate_alone()
        self._validation = list(alone)
        length = baseline = fmean(alone.values())
        if self.kept:
            length = self._plan_length(self.kept)
        explored = self._steps.explore()
        self._spent = sum(result.environment_steps for result in explored)
        ranked = rank(explored)
        self.callback.on_ranked(ranked)
        length = self._learn_from(ranked, mean_operator_steps(explored), length)
        record = self._record(explored, baseline, length)
        return ShortcutLibrary(self.distribution.domain.name, tuple(self._shortcuts), record)

    def _learn_from(
        self, ranked: Sequence[CandidateGroup], operator_steps: Mapping[str, float], length: float
    ) -> float:
        """Learn a shortcut from each group that is worth it, one after the other.

        Args:
            ranked: Candidates, the most promising first.
            operator_steps: Mean environment steps of each operator, by name.
            length: Mean plan length without shortcuts, environment steps.

        Returns:
            Mean plan length with what is kept.
        """
        kept: list[CandidateGroup] = []
        for _ in range(self.settings.shortcuts):
            if not self._affords(1):
                break
            group = self._most_promising(ranked, kept)
            if group is None:
                break
            ranked = other_problems(ranked, group)
            before, length = length, self._try(group, operator_steps, length)
            if length < before:
                kept.append(group)
        return length

    def _affords(self, shortcuts: int) -> bool:
        """Whether so many shortcuts can still be learned within the budget, as a rule."""
        needed = self._spent + shortcuts * self.settings.steps_per_shortcut
        return not self.settings.budget or needed <= self.settings.budget

    def _most_promising(
        self, groups: Sequence[CandidateGroup], kept: Sequence[CandidateGroup]
    ) -> CandidateGroup | None:
        """The group that saves most beside those learned already; None where none saves enough.

        Shortcuts are worth having together where they serve different tasks. The first of those
        that save the same is taken.
        """
        saving = [group.saving_beside(kept) for group in groups]
        most = max(saving, default=0.0)
        if most < self.settings.least_saving:
            return None
        return groups[saving.index(most)]

    def _shorter(self, steps: float, than: float) -> bool:
        """Whether a plan length is less by what a shortcut must save at least."""
        return steps < than * (1.0 - self.settings.least_saving)

    def _try(
        self, group: CandidateGroup, operator_steps: Mapping[str, float], length: float
    ) -> float:
        """Learn a shortcut and keep it if it shortens plans.

        Args:
            group: Candidates to learn a shortcut from.
            operator_steps: Mean environment steps of each operator, by name.
            length: Mean plan length without the shortcut, environment steps.

        Returns:
            Mean plan length with what is kept.
        """
        starts = self._steps.starts(group, operator_steps)
        if not starts:  # it can begin in no task
            return length
        attempts = self._steps.demonstrations(group, starts, self._left_to_demonstrate)
        cloning = self.settings.cloning
        repetitions = 0 if cloning is None else cloning.repetitions
        self._spent += sum(one.total_steps(repetitions) for one in attempts)
        shown = tuple(one.shown for one in attempts if one.shown is not None)
        if cloning is not None and not shown:  # nothing shows it
            return length
        learned = self._learn(group.signature, starts, shown)
        self._spent += int(learned.record.get("environment_steps", 0))
        learned = with_demonstrations(learned, attempts, repetitions)
        return self._judge(with_origin(learned, group), length)

    @property
    def _left_to_demonstrate(self) -> float:
        """Environment steps that may be spent before a policy is cloned and tried out."""
        settings = self.settings
        return settings.budget - self._spent - settings.policy_steps if settings.budget else inf

    def _judge(self, shortcut: Shortcut, length: float) -> float:
        """Keep a shortcut if it shortens plans.

        Args:
            shortcut: Shortcut that was learned.
            length: Mean plan length without the shortcut, environment steps.

        Returns:
            Mean plan length with what is kept.
        """
        with_it = self._plan_length((*self._shortcuts, shortcut))
        kept = self._shorter(with_it, length)
        self.callback.on_validated(shortcut.name, length, with_it, kept)
        if not kept:
            return length
        self._shortcuts.append(shortcut)
        return with_it

    def _require_same_settings(self) -> None:
        """Refuse a folder with another training."""
        place = self.distribution.as_json()
        self._work.require_same({"place": place, **self.settings.as_json(), **self._kept_record()})

    def _learn(
        self,
        signature: Signature,
        starts: tuple[StartRecord, ...],
        shown: tuple[ShortcutDemonstration, ...] = (),
    ) -> Shortcut:
        """Learn a shortcut in the most successful of as many attempts as it takes."""
        if self.settings.attempts == 1:
            return self._run_attempt(learn, self._attempt(signature, starts, 0, shown))
        first_stages: list[Progress] = []
        while len(first_stages) < self.settings.attempts:
            attempt = self._attempt(signature, starts, len(first_stages), shown)
            first_stages.append(self._run_attempt(learn_first_stage, attempt))
            if first_stages[-1].success >= ENOUGH_SUCCESS:
                break
        success = [stage.success for stage in first_stages]
        best = success.index(max(success))
        shortcut = self._run_attempt(learn, self._attempt(signature, starts, best, shown))
        in_vain = sum(stage.steps for i, stage in enumerate(first_stages) if i != best)
        steps = int(shortcut.record["environment_steps"]) + in_vain
        record = {**shortcut.record, "environment_steps": steps, "attempts": len(success)}
        return replace(shortcut, record=record)

    def _attempt(
        self,
        signature: Signature,
        starts: tuple[StartRecord, ...],
        number: int,
        shown: tuple[ShortcutDemonstration, ...],
    ) -> LearningAttempt:
        """An attempt to learn a shortcut.

        Args:
            signature: Signature of the shortcut.
            starts: Initial states of episodes.
            number: Number of the attempt, counted from 0.
            shown: Demonstrations of the shortcut.
        """
        folder = attempt_folder(self.folder, signature.name, number)
        return LearningAttempt(
            self.distribution,
            signature,
            starts,
            self.settings,
            str(folder),
            number,
            tuple(self._validation),
            tuple(self._shortcuts),
            shown,
        )

    def _run_attempt(
        self, function: Callable[[Any, int], Result], attempt: StagedAttempt
    ) -> Result:
        """The result of a job that learns in an attempt."""
        steps = attempt.settings.total_steps
        self.callback.on_learning(attempt.name, Path(attempt.folder), steps)
        ((_, result),) = self.workers.run(function, [(attempt, self.workers.processes)])
        return result

    def _plan_length(self, shortcuts: tuple[Shortcut, ...]) -> float:
        """Mean plan length on validation tasks, environment steps; infinite if one has no plan."""
        return mean_length(self._steps.plan_lengths(self._validation, shortcuts))

    def _kept_record(self) -> dict[str, Any]:
        """Which shortcuts are kept; nothing where none are."""
        if not self.kept:
            return {}
        digest = ShortcutLibrary(self.distribution.domain.name, self.kept).digest
        return {"kept": {"digest": digest, "shortcuts": [one.name for one in self.kept]}}

    def _record(
        self, explored: Sequence[ExplorationResult], baseline: float, length: float
    ) -> dict[str, Any]:
        learned = self._shortcuts[len(self.kept) :]
        steps = [int(shortcut.record.get("environment_steps", 0)) for shortcut in learned]
        return {
            "preset": self.distribution.domain.preset,
            "seed": self.distribution.seed,
            "validation": {"pure_planning": baseline, "slap": length},
            **self._kept_record(),
            "environment_steps": {
                "exploring": sum(result.environment_steps for result in explored),
                "learning": sum(steps),
                **({"spent": self._spent} if self.settings.budget else {}),
            },
            "settings": self.settings.as_json(),
            "versions": dict(versions()),
            "processor": processor(),
        }
