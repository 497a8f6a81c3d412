# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One training of a baseline: learn, keep checkpoints, choose the noise on validation tasks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from statistics import fmean
from time import monotonic
from typing import Any

from slap_ros.baselines.method import (
    CHECKPOINT,
    BaselineProgress,
    Method,
    MethodSettings,
    Report,
    TaskLearner,
)
from slap_ros.baselines.progress_curve import ProgressCurve
from slap_ros.baselines.trained_baseline import TrainedBaseline
from slap_ros.baselines.training_tasks import EACH, VALIDATION
from slap_ros.baselines.trials import task_progress, try_baseline
from slap_ros.environments.registration import make_task_env
from slap_ros.environments.task_env import TaskEnv
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.json_lines import append_line, decoded_lines
from slap_ros.learning.stored_keys import stored
from slap_ros.learning.success_curve import SUCCESS_CURVE, SuccessPoint, success_curve
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.work_folder import SETTINGS, WorkFolder
from slap_ros.versions import processor, versions

PROGRESS = "progress.jsonl"
CHECKPOINT_S = 60.0  # time between checkpoints
WITH_NOISE, WITHOUT_NOISE = 1.0, 0.0


@dataclass(frozen=True)
class BaselineTraining:
    """What is trained, on which tasks, and where it is kept.

    Args:
        method: Name of the method.
        kind: The method itself.
        settings: Settings of the method.
        distribution: Distribution of the tasks.
        goal: Goal of every task, by name or as atoms; None for each task's own.
        folder: Work folder: settings, checkpoints, progress.
    """

    method: str
    kind: Method
    settings: MethodSettings
    distribution: TaskDistribution
    goal: str | None
    folder: Path

    def run(self, report: Report) -> TrainedBaseline:
        """Train, or go on where an earlier run was interrupted.

        Args:
            report: Function that receives the figures about a hundred times.

        Raises:
            InvalidParameterError: The folder has another training, or is damaged.
        """
        self._require_own_folder()
        tasks, count = self.distribution.task_seed, self.settings.n_envs
        envs = self.kind.make_envs(self._make_env, tasks, count)
        learner = self.kind.make_learner(self.settings, envs, self.distribution.seed)
        if (self.folder / CHECKPOINT).exists():
            learner.resume(self.folder)
        curve = self._curve(learner)
        try:
            learner.learn(_TrainingLog(self.folder, learner, curve, report).report)
        finally:  # after Ctrl-C too
            learner.save(self.folder)
        measured = {"task_progress": curve.points} if curve else {}
        return self._chosen(learner, {SUCCESS_CURVE: self._success_curve(), **measured})

    def _require_own_folder(self) -> None:
        """Refuse a folder whose checkpoint is another training's, or nobody knows whose.

        Raises:
            InvalidParameterError: It is.
        """
        if (self.folder / CHECKPOINT).exists() and not (self.folder / f"{SETTINGS}.json").exists():
            raise InvalidParameterError(
                f"{self.folder} has a checkpoint, and no {SETTINGS}.json that says of which "
                "training: give another folder, or remove this one"
            )
        WorkFolder(self.folder).require_same(self._identity)

    def _curve(self, learner: TaskLearner) -> ProgressCurve | None:
        """What measures task progress now and then, where plans have stages to be rewarded for."""
        if self.kind.environment["reward"] != "stages":
            return None
        curve = ProgressCurve(
            self.folder,
            lambda: self._on_validation_tasks(self._trained(learner), task_progress),
            self.settings.total_steps,
        )
        curve.go_on(learner.progress.steps)
        return curve

    def _success_curve(self) -> list[list[float]]:
        """The success of recent episodes over environment steps, of earlier runs as well."""

        def point(line: Mapping[str, Any]) -> tuple[int, SuccessPoint]:
            return 0, SuccessPoint(int(line["steps"]), float(line["success"]))

        advice = "remove the folder to train from the beginning"
        return success_curve(decoded_lines(self.folder / PROGRESS, point, advice))

    @property
    def _identity(self) -> dict[str, Any]:
        place = self.distribution.as_json() | {"goal": self.goal}
        return {"method": self.method, "place": place, "settings": stored(self.settings)}

    def _make_env(self) -> TaskEnv:
        """An environment of the tasks."""
        choice = self.distribution.domain
        return make_task_env(
            choice.name, choice.preset, goal=self.goal, **dict(self.kind.environment)
        )

    def _trained(self, learner: TaskLearner) -> TrainedBaseline:
        """The policy as it is now, without its noise."""
        choice = self.distribution.domain
        return TrainedBaseline(
            self.method,
            choice.name,
            choice.preset,
            self.goal,
            self.kind.environment,
            learner.policy(),
            WITHOUT_NOISE,
        )

    def _chosen(self, learner: TaskLearner, measured: Mapping[str, Any]) -> TrainedBaseline:
        """The policy, with or without its noise: whichever does better on validation tasks.

        Args:
            learner: Learner that has learned.
            measured: Figures that were measured on the way, by name.
        """
        progress, trained = learner.progress, self._trained(learner)
        scales = (WITHOUT_NOISE, WITH_NOISE) if self.kind.noisy else (WITHOUT_NOISE,)
        validated = {scale: self._success(replace(trained, noise=scale)) for scale in scales}
        record = {
            "seed": self.distribution.seed,
            "environment_steps": progress.steps,
            "episodes": progress.episodes,
            **progress.figures,
            "cpu_s": round(progress.cpu_s, 1),
            **measured,
            "validation": {f"noise {scale:g}": rate for scale, rate in validated.items()},
            "settings": stored(self.settings),
            "versions": dict(versions()),
            "processor": processor(),
        }
        best = max(validated, key=lambda scale: validated[scale])
        return replace(trained, noise=best, record=record)

    def _success(self, baseline: TrainedBaseline) -> float:
        """The share of validation tasks that are solved."""
        return self._on_validation_tasks(baseline, lambda *task: float(try_baseline(*task).success))

    def _on_validation_tasks(
        self,
        baseline: TrainedBaseline,
        judge: Callable[[TrainedBaseline, str, str | None, int, int], float],
    ) -> float:
        """The mean over validation tasks of what a function gives for each."""
        seed, preset = self.distribution.task_seed, baseline.preset
        tasks = self._validation_tasks
        return fmean(judge(baseline, preset, self.goal, seed, index) for index in tasks)

    @cached_property
    def _validation_tasks(self) -> list[int]:
        """Indices of the first ones that the environment has room for, as training's are."""
        fitting = self._make_env().fitting_tasks(
            self.distribution.task_seed, iter(VALIDATION.batch(0, EACH))
        )
        return [index for index, _ in islice(fitting, self.settings.validation)]


class _TrainingLog:
    """Appends figures to the progress file, measures and saves a checkpoint now and then."""

    def __init__(
        self, folder: Path, learner: TaskLearner, curve: ProgressCurve | None, report: Report
    ) -> None:
        self._folder, self._learner, self._report = folder, learner, report
        self._curve = curve
        self._saved = monotonic()

    def report(self, progress: BaselineProgress) -> None:
        """Write a line, and maybe a checkpoint."""
        append_line(self._folder / PROGRESS, progress.as_json())
        if monotonic() - self._saved > CHECKPOINT_S:
            self._learner.save(self._folder)
            self._saved = monotonic()
        if self._curve is not None:
            self._curve.advance(progress.steps)
        self._report(progress)
