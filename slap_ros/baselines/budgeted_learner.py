# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An algorithm of stable-baselines3 on the training tasks, until environment steps are used up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from slap_ros.baselines.method import CHECKPOINT, BaselineProgress, Report
from slap_ros.baselines.training_envs import TrainingEnvs
from slap_ros.learning.checkpoint import load_checkpoint, save_checkpoint
from slap_ros.policies.mlp_policy import MlpPolicy

ENDLESS = 2**62  # steps of an algorithm, which the budget ends
REPORTS = 100  # approximate number of reports of a training


class BudgetedLearner(ABC):
    """Learns for as many environment steps as it is given, and goes on after an interruption."""

    def __init__(
        self, algorithm: BaseAlgorithm, envs: TrainingEnvs, total_steps: int, seed: int
    ) -> None:
        """Begin before the first step.

        Args:
            algorithm: Algorithm, which acts in these environments.
            envs: Environments of the training tasks.
            total_steps: Environment steps of the whole training.
            seed: Seed of weights and noise.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.algorithm, self.envs = algorithm, envs
        self._total_steps, self._seed = total_steps, seed
        self.progress = self._before = BaselineProgress()
        self._began = process_time()

    @abstractmethod
    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch."""

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Tensors that a checkpoint has."""

    @abstractmethod
    def restore(self, saved: Mapping[str, Any]) -> None:
        """Take back what :meth:`state` gave; it may raise any error."""

    def figures(self) -> Mapping[str, float]:
        """Figures that only this method has, by name."""
        return {}

    def learn(self, report: Report) -> None:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        if self._before.steps >= self._total_steps:
            return
        callback = _StepBudget(self._measure, self._total_steps, report)
        try:
            self.algorithm.learn(ENDLESS, callback, reset_num_timesteps=False)
        finally:
            self._measure()
        report(self.progress)

    def _measure(self) -> BaselineProgress:
        """The figures so far, of earlier runs as well."""
        tally = self.envs.tally
        self.progress = BaselineProgress(
            self._before.steps + tally.steps,
            self._before.episodes + tally.episodes,
            float(np.mean(tally.recent)) if tally.recent else 0.0,
            self._before.cpu_s + process_time() - self._began,
            self._total_steps,
            self.figures(),
        )
        return self.progress

    def save(self, folder: Path) -> None:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        progress = self.progress
        done = {
            "steps": progress.steps,
            "episodes": progress.episodes,
            "cpu_s": progress.cpu_s,
        }
        save_checkpoint(folder / CHECKPOINT, done | self.state())

    def resume(self, folder: Path) -> None:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        advice = "remove the folder to train from the beginning"
        load_checkpoint(folder / CHECKPOINT, self._go_on_from, advice)

    def _go_on_from(self, saved: Mapping[str, Any]) -> None:
        """Take weights back, and let tasks and noise be others than at the beginning."""
        steps, episodes, cpu_s = int(saved["steps"]), int(saved["episodes"]), float(saved["cpu_s"])
        self.restore(saved)
        self.progress = self._before = BaselineProgress(steps, episodes, cpu_s=cpu_s)
        noise = np.random.SeedSequence([self._seed, steps]).generate_state(1)[0]
        self.algorithm.set_random_seed(int(noise // 2))
        self.envs.skip(steps)


class _StepBudget(BaseCallback):
    """Reports about a hundred times, and ends learning once the steps are used up."""

    def __init__(
        self, measure: Callable[[], BaselineProgress], total_steps: int, report: Report
    ) -> None:
        super().__init__()
        self._measure, self._total, self._report = measure, total_steps, report
        self._every = max(1, total_steps // REPORTS)
        self._next = measure().steps + self._every

    def _on_step(self) -> bool:
        progress = self._measure()
        if progress.steps >= self._next:
            self._next = progress.steps + self._every
            self._report(progress)
        return progress.steps < self._total
