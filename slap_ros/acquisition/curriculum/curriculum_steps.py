# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The steps of a curriculum that are jobs: carrying out plans, trying skills, learning them.

What a step has found is kept in the curriculum's folder, so that it is found once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.curriculum.after_shortcuts import ShortcutsChoice
from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback, OngoingRound
from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.initiation_states import InitiationRecord
from slap_ros.acquisition.curriculum.jobs import LearningJob
from slap_ros.acquisition.curriculum.known_or_learned import KnownOrLearned, compare
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.acquisition.training.warm_start import WarmStart
from slap_ros.learning.finished_jobs import FinishedJobs
from slap_ros.learning.workers import Workers, run_in_order

States = Sequence[InitiationRecord]


@dataclass(frozen=True)
class CurriculumSteps:
    """Runs the steps of one curriculum.

    Args:
        source: Source of tasks, operators and rewards.
        results: Folder of the results.
        workers: Workers that run the jobs.
        callback: Callback that receives the events of the curriculum.
        shortcuts: Shortcuts after which skills are tried as well; None for no shortcuts.
    """

    source: TaskSource
    results: CurriculumFolder
    workers: Workers
    callback: CurriculumCallback
    shortcuts: ShortcutsChoice | None

    def roll_out(
        self, iteration: int, name: str, tasks: Sequence[int], skills: Mapping[str, str]
    ) -> list[PlanRollout]:
        """Carry out plans, and what a search tries after shortcuts, if there are any.

        Args:
            iteration: Number of the iteration, from 0.
            name: Purpose of the plans; see :meth:`CurriculumFolder.rollouts`.
            tasks: Indices of the tasks.
            skills: Folders of the skills, by operator name.

        Returns:
            The rollouts of the tasks, in their order, before those after shortcuts.
        """
        work = [(self.source, index, skills) for index in tasks]
        return self.results.rollouts(iteration, name, partial(self._carry_out, work))

    def _carry_out(
        self, work: Sequence[tuple[TaskSource, int, Mapping[str, str]]], finished: FinishedJobs
    ) -> list[Any]:
        plans = self._run("carrying out plans", jobs.carry_out, work, finished)
        if self.shortcuts is None:
            return plans
        after = [(*one, self.shortcuts) for one in work]
        tried = self._run(
            "trying skills after shortcuts", jobs.try_after_shortcuts, after, finished
        )
        return [*plans, *(rollout for task in tried for rollout in task)]

    def try_known(
        self, iteration: int, starts: Sequence[tuple[str, Sequence[WarmStart], States]]
    ) -> list[list[float]]:
        """Try known skills in place of new ones.

        Args:
            iteration: Number of the iteration, from 0.
            starts: For each new skill the name of its operator, the known skills, and the
                initiation states that they are tried from.

        Returns:
            Success rates of the known skills, for each new one.
        """
        work = [(self.source, *one) for one in starts]
        trying = partial(self._run, "trying known skills", jobs.try_known, work)
        return self.results.known(iteration, trying)

    def learn(self, iteration: int, rounds: Sequence[LearningJob], left: int) -> list[Round]:
        """Train skills for a round each.

        Args:
            iteration: Number of the iteration, from 0.
            rounds: Rounds of training, at least one.
            left: Environment steps that are left of the budget.

        Returns:
            How each went, in their order.
        """
        return self.results.rounds(iteration, lambda: self._learn(iteration, rounds, left))

    def _learn(self, iteration: int, rounds: Sequence[LearningJob], left: int) -> list[Any]:
        self.callback.on_learning(iteration, [OngoingRound.of(job) for job in rounds], left)
        each = max(1, self.workers.processes // len(rounds))
        return self._run("learning skills", jobs.learn, [(job, each) for job in rounds])

    def compare(self, learned: Sequence[tuple[WarmStart, Path, States]]) -> list[KnownOrLearned]:
        """Try known skills and what was learned from them.

        Args:
            learned: For each skill the known one that it began with, its folder, and the
                initiation states that both are tried from.
        """
        work = [(self.source, *one) for one in learned]
        return self.results.compared(lambda: self._run("trying known skills", compare, work))

    def vacuity(self, skills: Sequence[tuple[str, States]], episodes: int) -> list[Any]:
        """Try policies that see nothing in the place of skills.

        Args:
            skills: For each skill the name of its operator and its initiation states.
            episodes: Number of episodes of each policy.

        Returns:
            The vacuity of each skill, as JSON.
        """
        work = [(self.source, *one, episodes) for one in skills]
        return self.results.vacuity(
            partial(self._run, "trying constant actions", jobs.vacuity, work)
        )

    def _run(
        self,
        what: str,
        function: Callable[..., Any],
        work: Sequence[tuple[Any, ...]],
        finished: FinishedJobs | None = None,
    ) -> list[Any]:
        """The results of a step's jobs, in their order.

        Args:
            what: Name of the step, in words.
            function: Function of a job.
            work: Arguments of the function, one tuple for each job.
            finished: Jobs that have ended already; None where each keeps what it has done itself.
        """
        return run_in_order(self.workers, function, work, what, self.callback, finished)
