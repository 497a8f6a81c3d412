# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training a library: explore, rank, learn, keep what shortens plans, and again (SLAP §4.2).

Every result is kept in a work folder, so that the same command continues where it was
interrupted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from statistics import fmean
from typing import Any, Protocol, TypeVar

from slap_ros.errors import UnsolvableError
from slap_ros.learning.finished_jobs import FinishedJobs, cached_jobs
from slap_ros.learning.progress_callback import ProgressCallback
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.learning.task_range import TaskRange
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import Workers, run_in_order
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.approaches import APPROACHED
from slap_ros.shortcuts.demonstrations import ShortcutDemonstration
from slap_ros.shortcuts.exploration_policies import RANDOM
from slap_ros.shortcuts.exploration_result import ExplorationResult
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
from slap_ros.shortcuts.shortcut_candidate import OperatorPath, ShortcutCandidate
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.shortcuts.signature import Pattern, Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.work_folder import attempt_folder
from slap_ros.versions import processor, versions

Result = TypeVar("Result")
MAX_NAME = 245  # bytes of a result's name: with what a draft of its file has besides, 255
UNRECORDED = "why was not recorded"  # in work folders of version 0.1.0


class TrainingCallback(ProgressCallback, Protocol):
    """Receives the events of a training."""

    def on_left_out(self, use: str, index: int, reason: str) -> None:
        """A task has no plan, and training goes on without it.

        Args:
            use: Purpose of the task: validation or exploration.
            index: Index of the task, with the seed of training tasks.
            reason: Reason why the task has no plan, in words.
        """
        ...

    def on_ranked(self, ranked: Sequence[CandidateGroup]) -> None:
        """Exploration is over; these are worth learning, the most promising first."""
        ...

    def on_learning(self, name: str, folder: Path, total_steps: int) -> None:
        """A shortcut is about to be learned.

        Args:
            name: Name of the shortcut.
            folder: Folder with the progress of the shortcut; see
                :class:`~slap_ros.shortcuts.work_folder.ShortcutWorkFolder`.
            total_steps: Environment steps that learning the shortcut takes.
        """
        ...

    def on_validated(self, name: str, before: float, after: float, kept: bool) -> None:
        """A shortcut was learned, and tried on validation tasks.

        Args:
            name: Name of the shortcut.
            before: Mean plan length without the shortcut, environment steps.
            after: Mean plan length with the shortcut, environment steps; infinite where a task was
                not solved.
            kept: Whether the shortcut becomes part of the library.
        """
        ...


@dataclass(frozen=True)
class CandidateGroup:
    """Candidates of several tasks that are the same up to objects: one learning problem.

    Args:
        signature: Signature of the candidate with the largest expected saving.
        operator_path: Names of the operators by which the candidates' sources were reached.
        savings: Share of the plan's length that the candidate is expected to save in each explored
            task; 0 where there was none.
        beyond: Whether a candidate leads to an abstract state that operators alone do not reach.
        found_by: Names of the exploration policies that found candidates.
        replaced: Names of the skills that show it; none where something else found it.
    """

    signature: Signature
    operator_path: OperatorPath
    savings: tuple[float, ...]
    beyond: bool = False
    found_by: tuple[str, ...] = (RANDOM,)
    replaced: OperatorPath = ()

    @property
    def tasks(self) -> int:
        """The number of explored tasks that have a candidate of the group."""
        return sum(saving > 0.0 for saving in self.savings)

    @property
    def relative_saving(self) -> float:
        """The expected saving as a share of a plan's length, mean over all explored tasks."""
        return fmean(self.savings)

    def saving_beside(self, others: Sequence[CandidateGroup]) -> float:
        """The expected saving beyond the best of others in each task, mean over tasks.

        What is in the place of skills that come before or after adds to it instead.

        Args:
            others: Groups that are learned already.
        """
        rivals = [o for o in others if not (self.comes_after(o) or o.comes_after(self))]
        return fmean(
            max(0.0, own - max(best, default=0.0))
            for own, *best in zip(self.savings, *(other.savings for other in rivals), strict=True)
        )

    def comes_after(self, other: CandidateGroup) -> bool:
        """Whether it begins where the skills that show another one have ended, or later.

        Args:
            other: Candidates of another learning problem.
        """
        until = (*other.operator_path, *other.replaced)
        return bool(other.replaced) and self.operator_path[: len(until)] == until


ProblemKey = tuple[frozenset[Pattern], frozenset[str]]  # equal for equal learning problems


def problem_key(signature: Signature) -> ProblemKey:
    """A key that is the same for signatures that a single policy is learned for."""
    return signature.patterns, signature.context


def rank(explored: Sequence[ExplorationResult]) -> list[CandidateGroup]:
    """Group candidates that are the same up to objects; the largest relative saving first."""
    groups: dict[tuple[ProblemKey, OperatorPath], dict[int, ShortcutCandidate]] = {}
    for task, result in enumerate(explored):
        for key, candidate in _best_by_key(result).items():
            groups.setdefault(key, {})[task] = candidate
    ranked = [
        CandidateGroup(
            max(group.values(), key=lambda c: (c.expected_saving, c.signature.name)).signature,
            operator_path,
            tuple(_saving(group.get(task)) for task in range(len(explored))),
            any(candidate.beyond for candidate in group.values()),
            tuple(dict.fromkeys(name for c in group.values() for name in c.found_by)),
            next((c.replaced for c in group.values() if c.replaced), ()),
        )
        for (_, operator_path), group in groups.items()
    ]
    return sorted(ranked, key=lambda g: (-g.relative_saving, g.signature.name, g.operator_path))


def _saving(candidate: ShortcutCandidate | None) -> float:
    """The expected saving of a candidate as a share of the plan's length; 0 without one."""
    return candidate.expected_saving / candidate.plan_steps if candidate is not None else 0.0


def _best_by_key(
    result: ExplorationResult,
) -> dict[tuple[ProblemKey, OperatorPath], ShortcutCandidate]:
    """The candidate that saves most, of one task's candidates that are the same up to objects."""
    best: dict[tuple[ProblemKey, OperatorPath], ShortcutCandidate] = {}
    for candidate in result.candidates:
        key = (problem_key(candidate.signature), candidate.operator_path)
        if key not in best or candidate.expected_saving > best[key].expected_saving:
            best[key] = candidate
    return best


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
        self._work = WorkFolder(self.folder)
        self._shortcuts.extend(self.kept)
        self._kept = KeptShortcuts(self.kept, self.settings.sampling)

    def run(self) -> ShortcutLibrary:
        """Train until nothing else is worth learning, or go on where an earlier run ended.

        Raises:
            ChildProcessError: A process that stepped environments has ended.
            InvalidParameterError: The folder has a training with other settings, or is damaged; or
                the settings want more tasks than there are for a use.
            UnsolvableError: No validation task has a plan, or no task to be explored has one.
        """
        self._require_tasks()
        self._require_same_settings()
        length = baseline = self._validate_without()
        if self.kept:
            length = self._plan_length(self.kept)
        explored = self._explore()
        self._spent = sum(result.environment_steps for result in explored)
        ranked = rank(explored)
        self.callback.on_ranked(ranked)
        operator_steps = mean_steps(explored)
        length = self._learn_from(ranked, operator_steps, length)
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
        """Whether so many shortcuts can still be learned within the budget."""
        needed = self._spent + shortcuts * self.settings.most_steps
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
        starts = self._starts(group, operator_steps)
        if not starts:  # it can begin in no task
            return length
        shown = self._demonstrations(group, starts)
        if self.settings.cloning is not None and not shown:  # nothing shows it
            return length
        learned = with_demonstrations(self._learn(group.signature, starts, shown), shown)
        self._spent += int(learned.record.get("environment_steps", 0))
        return self._judge(with_origin(learned, group), length)

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

    @property
    def _any_goal(self) -> TaskDistribution:
        """The tasks that are explored and validated on."""
        return jobs.any_goal(self.distribution, self.settings.random_goals)

    # -- the steps --------------------------------------------------------------------------------

    def _require_same_settings(self) -> None:
        """Refuse a folder with another training."""
        place = self.distribution.as_json()
        self._work.require_same({"place": place, **self.settings.as_json(), **self._kept_record()})

    def _explore(self) -> list[ExplorationResult]:
        return cached_jobs(
            self._work,
            "explored",
            self._explore_what_can_be,
            lambda data: [ExplorationResult.from_json(result) for result in data],
        )

    def _require_tasks(self) -> None:
        """Refuse settings with so many tasks that some would have two uses."""
        jobs.EXPLORATION.batch(0, self.settings.exploration.tasks)
        jobs.STARTS.batch(0, self.settings.starts)
        jobs.VALIDATION.batch(0, self.settings.validation)

    def _explore_what_can_be(self, finished: FinishedJobs) -> list[Any]:
        tasks = self.settings.exploration.tasks
        work = [(self._any_goal, i, self.settings.exploration, self._kept) for i in range(tasks)]
        found = self._run("exploring tasks", jobs.try_to_explore, work, finished)
        self._leave_out(jobs.EXPLORATION, found)
        return [result for result in found if not isinstance(result, str)]

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

    def _validate_without(self) -> float:
        """Mean plan length without shortcuts; validation tasks without a plan are left out."""
        lengths = self._plan(range(self.settings.validation), ())
        self._leave_out(jobs.VALIDATION, lengths)
        solved = {i: length for i, length in enumerate(lengths) if isinstance(length, int)}
        self._validation = list(solved)
        return fmean(solved.values())

    def _starts(
        self, group: CandidateGroup, operator_steps: Mapping[str, float]
    ) -> tuple[StartRecord, ...]:
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
                self._kept,
            )
            for i in range(self.settings.starts)
        ]
        return cached_jobs(
            self._work,
            f"{name}/starts",
            lambda finished: self._run("collecting starts", jobs.start, work, finished),
            lambda data: tuple(StartRecord.from_json(one) for one in data if one is not None),
        )

    def _demonstrations(
        self, group: CandidateGroup, starts: tuple[StartRecord, ...]
    ) -> tuple[ShortcutDemonstration, ...]:
        """Demonstrations of a shortcut, for cloning."""
        cloning, exploration = self.settings.cloning, self.settings.exploration
        if cloning is None:
            return ()
        push = exploration.length if APPROACHED in group.found_by else 0
        tries = cloning.straightened
        work = [
            (self.distribution, start, group.signature, tries, self._kept, push) for start in starts
        ]
        return cached_jobs(
            self._work,
            f"{group.signature.name}/demonstrations",
            lambda finished: self._run("straightening skills", jobs.demonstration, work, finished),
            lambda data: tuple(
                ShortcutDemonstration.from_json(one) for one in data if one is not None
            ),
        )

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
        return jobs.mean_length(self._plan(self._validation, shortcuts))

    def _plan(self, tasks: Sequence[int], shortcuts: tuple[Shortcut, ...]) -> list[int | str]:
        """Steps of a plan for each of these validation tasks, or why there is none."""
        work = [(self._any_goal, i, shortcuts, self.settings.sampling) for i in tasks]
        return cached_jobs(
            self._work,
            plans_name([shortcut.name for shortcut in shortcuts]),
            lambda finished: self._run("planning", jobs.plan_length, work, finished),
            lambda data: _decode_lengths(data, len(work)),
        )

    def _run(
        self,
        what: str,
        function: Any,
        work: Sequence[tuple[Any, ...]],
        finished: FinishedJobs,
    ) -> list[Any]:
        """The results of a step's jobs, in their order."""
        return run_in_order(self.workers, function, work, what, self.callback, finished)

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


def other_problems(
    groups: Sequence[CandidateGroup], learned: CandidateGroup
) -> list[CandidateGroup]:
    """The groups that another policy is learned for than for one of them."""
    key = problem_key(learned.signature)
    return [other for other in groups if problem_key(other.signature) != key]


def with_origin(shortcut: Shortcut, group: CandidateGroup) -> Shortcut:
    """The shortcut, whose record says what found it; random actions do where it says nothing."""
    if group.found_by == (RANDOM,):
        return shortcut
    return replace(shortcut, record={**shortcut.record, "found_by": list(group.found_by)})


def with_demonstrations(shortcut: Shortcut, shown: Sequence[ShortcutDemonstration]) -> Shortcut:
    """The shortcut, whose record counts demonstrations and the environment steps they took."""
    if not shown:
        return shortcut
    steps = sum(one.environment_steps for one in shown)
    counts = {
        "environment_steps": int(shortcut.record["environment_steps"]) + steps,
        "demonstrations": {
            "number": len(shown),
            "environment_steps": steps,
            "skills": fmean(one.replaced for one in shown),
            "straightened": fmean(len(one.actions) for one in shown),
        },
    }
    return replace(shortcut, record={**shortcut.record, **counts})


def mean_steps(explored: Sequence[ExplorationResult]) -> dict[str, float]:
    """Mean environment steps of each operator over all explored tasks, by name."""
    steps: dict[str, list[float]] = {}
    for result in explored:
        for name, mean in result.operator_steps.items():
            steps.setdefault(name, []).append(mean)
    return {name: fmean(means) for name, means in steps.items()}
