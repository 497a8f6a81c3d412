# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The steps of a training that are jobs: exploring, collecting starts, planning, and so on.

What a step has found is kept in the work folder, so that it is found once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from math import inf
from typing import Any

from slap_ros.errors import UnsolvableError
from slap_ros.learning.finished_jobs import FinishedJobs, cached_jobs
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.task_range import TaskRange
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import Workers, run_in_order
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.approaches import APPROACHED
from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.demonstrations import DemonstrationAttempt, most_demonstration_steps
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.kept_shortcuts import KeptShortcuts
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.training_callback import TrainingCallback

IN_VAIN = 20  # starts from which nothing shows a shortcut, after which it is given up
MAX_NAME = 245  # bytes of a result's name: with what a draft of its file has besides, 255
UNRECORDED = "why was not recorded"  # in work folders of version 0.1.0


@dataclass(frozen=True)
class TrainingSteps:
    """Runs the steps of one training.

    Args:
        distribution: Distribution of the tasks that the shortcuts are for.
        settings: All hyper-parameters of the training.
        work: Work folder of the training.
        workers: Workers that run the jobs.
        callback: Callback that receives the events of the training.
        kept: Shortcuts that are options like any other.
    """

    distribution: TaskDistribution
    settings: TrainingSettings
    work: WorkFolder
    workers: Workers
    callback: TrainingCallback
    kept: KeptShortcuts

    def require_tasks(self) -> None:
        """Refuse settings with so many tasks that some would have two uses."""
        jobs.EXPLORATION.batch(0, self.settings.exploration.tasks)
        jobs.STARTS.batch(0, self.settings.starts)
        jobs.VALIDATION.batch(0, self.settings.validation)

    def explore(self) -> list[ExplorationResult]:
        """Explore tasks; those without a plan are left out.

        Raises:
            UnsolvableError: No task to be explored has a plan.
        """
        return cached_jobs(
            self.work,
            "explored",
            self._explore_what_can_be,
            lambda data: [ExplorationResult.from_json(result) for result in data],
        )

    def _explore_what_can_be(self, finished: FinishedJobs) -> list[Any]:
        tasks = self.settings.exploration.tasks
        work = [(self._any_goal, i, self.settings.exploration, self.kept) for i in range(tasks)]
        found = self._run("exploring tasks", jobs.try_to_explore, work, finished)
        self._leave_out(jobs.EXPLORATION, found)
        return [result for result in found if not isinstance(result, str)]

    def starts(
        self, group: CandidateGroup, operator_steps: Mapping[str, float]
    ) -> tuple[StartRecord, ...]:
        """Collect initial states of a shortcut's episodes, one from each task that has one.

        Args:
            group: Candidates that the shortcut is learned from.
            operator_steps: Mean environment steps of each operator, by name.
        """
        name, cloning = group.signature.name, self.settings.cloning
        anywhere = cloning is not None and cloning.anywhere
        work = [
            (
                self.distribution,
                i,
                group.signature,
                group.operator_path,
                operator_steps,
                group.beyond,
                anywhere,
                self.kept,
            )
            for i in range(self.settings.starts)
        ]
        return cached_jobs(
            self.work,
            f"{name}/starts",
            lambda finished: self._run("collecting starts", jobs.start, work, finished),
            lambda data: tuple(StartRecord.from_json(one) for one in data if one is not None),
        )

    def demonstrations(
        self, group: CandidateGroup, starts: tuple[StartRecord, ...], left: float = inf
    ) -> tuple[DemonstrationAttempt, ...]:
        """Make demonstrations of a shortcut, for cloning; none where it is not to be cloned.

        Args:
            group: Candidates that the shortcut is learned from.
            starts: Starts that it is demonstrated from; the first ones alone if nothing shows it
                there.
            left: Environment steps that are left for it; from no start is it demonstrated that
                could take more.

        Returns:
            What came of demonstrating it from each start that was tried.
        """
        cloning, exploration = self.settings.cloning, self.settings.exploration
        if cloning is None:
            return ()
        push = exploration.length if APPROACHED in group.found_by else 0
        tries = cloning.straightened
        work = [
            (self.distribution, start, group.signature, tries, self.kept, push) for start in starts
        ]
        most = most_demonstration_steps(
            self.distribution.make_domain(),
            group.signature,
            tries + 1 + cloning.repetitions,
            self.settings.horizon,
            push,
        )

        def within_budget(finished: FinishedJobs) -> list[Any]:
            return self._demonstrate(work, left, most, cloning.repetitions, finished)

        return cached_jobs(
            self.work,
            f"{group.signature.name}/demonstrations",
            within_budget,
            lambda data: tuple(DemonstrationAttempt.from_json(one) for one in data),
        )

    def _demonstrate(
        self,
        work: Sequence[tuple[Any, ...]],
        left: float,
        most: int,
        repetitions: int,
        finished: FinishedJobs,
    ) -> list[Any]:
        """Make demonstrations, as many as can be paid: what some have not taken is for others.

        Where nothing shows it, everything is tried, which takes most. So it is given up soon.

        Args:
            work: Arguments of each job.
            left: Environment steps that are left for all of them.
            most: Environment steps that one of them takes at most.
            repetitions: Number of times that each is made again.
            finished: Jobs that have ended already.

        Returns:
            JSON of each attempt.
        """
        made: list[Any] = []
        while len(made) < len(work):
            attempts = [DemonstrationAttempt.from_json(one) for one in made]
            spent = sum(one.total_steps(repetitions) for one in attempts)
            paid = len(work) if left == inf else len(made) + int(left - spent) // most
            in_vain = all(one.shown is None for one in attempts)
            asked = min(paid, IN_VAIN) if in_vain else paid
            if asked <= len(made):
                break
            paid_for = work[:asked]
            made = self._run("straightening skills", jobs.demonstration, paid_for, finished)
        return made

    def validate_alone(self) -> dict[int, int]:
        """Plan for validation tasks without shortcuts.

        Returns:
            Environment steps of the plan of each task, by its index; tasks without a plan are left
            out.

        Raises:
            UnsolvableError: No validation task has a plan.
        """
        lengths = self.plan_lengths(range(self.settings.validation), ())
        self._leave_out(jobs.VALIDATION, lengths)
        return {i: length for i, length in enumerate(lengths) if isinstance(length, int)}

    def plan_lengths(
        self, tasks: Sequence[int], shortcuts: tuple[Shortcut, ...]
    ) -> list[int | str]:
        """Plan for validation tasks.

        Args:
            tasks: Indices of the tasks.
            shortcuts: Shortcuts that may be used besides the given options.

        Returns:
            Environment steps of each plan, or why there is none, in words.
        """
        work = [(self._any_goal, i, shortcuts, self.settings.sampling) for i in tasks]
        return cached_jobs(
            self.work,
            plans_name([shortcut.name for shortcut in shortcuts]),
            lambda finished: self._run("planning", jobs.plan_length, work, finished),
            lambda data: _decode_lengths(data, len(work)),
        )

    def _leave_out(self, tasks: TaskRange, found: Sequence[Any]) -> None:
        """Report the tasks that have no plan, and why.

        Args:
            tasks: Range of the tasks: for validation, or for exploration.
            found: Result of each task, or why there is none, in words.

        Raises:
            UnsolvableError: None of the tasks has a plan.
        """
        reasons = {i: reason for i, reason in enumerate(found) if isinstance(reason, str)}
        for i, reason in reasons.items():
            self.callback.on_left_out(tasks.use, tasks.index(i), reason)
        if len(reasons) == len(found):
            domain = self.distribution.domain
            raise UnsolvableError(
                f"none of {len(found)} tasks for {tasks.use} has a plan, so there is nothing to "
                f"shorten. The first: {reasons[0]}. `slap plan {domain.name} --preset "
                f"{domain.preset} --seed {self.distribution.task_seed} --index {tasks.first}` "
                "plans for it"
            )

    @property
    def _any_goal(self) -> TaskDistribution:
        """The tasks that are explored and validated on."""
        return jobs.any_goal(self.distribution, self.settings.random_goals)

    def _run(
        self,
        what: str,
        function: Any,
        work: Sequence[tuple[Any, ...]],
        finished: FinishedJobs,
    ) -> list[Any]:
        """The results of a step's jobs, in their order."""
        return run_in_order(self.workers, function, work, what, self.callback, finished)


def plans_name(shortcuts: Sequence[str]) -> str:
    """The name of the file of plans with shortcuts, which has their names as long as it can.

    Args:
        shortcuts: Names of the shortcuts.
    """
    name = "+".join(["plans", *shortcuts])
    if len(name.encode()) <= MAX_NAME:
        return name
    return f"plans+{sha256(name.encode()).hexdigest()}"


def _decode_lengths(data: Any, count: int) -> list[int | str]:
    """Plan lengths, or why there is none, which version 0.1.0 did not record."""
    if not isinstance(data, list) or len(data) != count:
        raise TypeError(f"{data!r} is no list of {count} plan lengths")
    lengths = [UNRECORDED if length is None else length for length in data]
    for length in lengths:
        if isinstance(length, bool) or not isinstance(length, int | str):
            raise TypeError(f"{length!r} is no plan length")
    return lengths
