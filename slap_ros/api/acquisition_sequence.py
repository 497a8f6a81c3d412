# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One task after another, with one library that grows: continual learning (LG-SAIL §5, Fig. 5).

Each goal of a sequence is an acquisition of its own, which keeps the library of the goal before it:
skills that carry out the new goal are used as they are, and learned further where they fail: their
trainings go on, with critics, replay buffers and some of the states of earlier goals. A goal is
over once three judgements in a row had .8 of its tasks solved, unless the setting ``solved`` says
otherwise. After each, all goals so far are tried, so that what was forgotten shows. A work folder
has::

    0-task0/library, 0-task0/training    the library after the first goal, and its work folder
    0-task0/tried.json                   what comes of plans for all goals so far with that library
    0-task0/.tried.jsonl                 the same for each goal, while others are being tried

Interrupted at any time, the same sequence goes on from there. After each goal, its library is also
that of the whole sequence so far.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback
from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_training import ENOUGH_IN_A_ROW
from slap_ros.api.acquisition import AcquisitionWatch, carry_out
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.command_line import command_line
from slap_ros.api.jobs import some_workers
from slap_ros.api.learning_curves import PLAN, CurveCallback, steps_to
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.finished_jobs import FinishedJobs, cached_jobs
from slap_ros.learning.setting_changes import parse_changes
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import run_in_order
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_library import SkillLibrary, save_skill_library

SEQUENCE_SEED = 400  # seed of the tasks that goals are tried in; training and studies use others
LEVEL = 0.8  # share of tasks that are solved up to which steps are counted, as in the paper

_Tries = Mapping[str, list[float]]  # task progress of each task, by goal


@dataclass(frozen=True)
class SequenceRequest:
    """A sequence of goals, and how skills are acquired for them.

    Args:
        acquisition: Request for the acquisitions, whose goal and library to keep do not count; its
            folders are those of the whole sequence. A goal is done at ``LEVEL`` where its changes
            do not say at which share of ``solved`` tasks.
        goals: Names of the goals, or atoms, in their order; two at least.
        scratch: Whether every goal is learned from scratch, for comparison.
        tasks: Number of tasks per goal in which all goals so far are tried after each.

    Raises:
        InvalidParameterError: There are fewer than two goals, or one twice.
    """

    acquisition: AcquisitionRequest
    goals: Sequence[str]
    scratch: bool = False
    tasks: int = 20

    def __post_init__(self) -> None:
        domain = self.acquisition.domain
        if len(self.goals) < 2:
            raise InvalidParameterError(
                f"a sequence has two goals at least; {domain.name} has "
                f"{', '.join(domain.goals) or 'none by name'}: give more with --goal"
            )
        if len(set(self.goals)) < len(self.goals):
            raise InvalidParameterError("a goal stands twice in the sequence; leave one out")

    @property
    def command(self) -> str:
        """The command that acquires the same library again."""
        base = self.acquisition
        own = list(self.goals) == list(base.domain.goals)
        return command_line(
            "acquire-sequence",
            base.domain.name,
            preset=base.domain.preset,
            goal=None if own else list(self.goals),
            seed=base.seed,
            scratch=self.scratch or None,
            tasks=self.tasks,
            settings=base.settings,
            steps=base.steps,
            set=list(base.changes) or None,
        )

    def acquisition_of(self, number: int) -> AcquisitionRequest:
        """The request for the acquisition of a goal.

        Args:
            number: Number of the goal, from 0.

        Raises:
            InvalidParameterError: The settings cannot be changed so.
        """
        base, folder = self.acquisition, self.folder(number)
        given = parse_changes(base.changes, AcquisitionSettings)
        done = () if "solved" in given else (f"solved={LEVEL}",)
        return replace(
            base,
            goal=self.goals[number],
            changes=(*done, *base.changes),
            keep=self.folder(number - 1) / "library" if number and not self.scratch else None,
            library_folder=folder / "library",
            work_folder=folder / "training",
        )

    def folder(self, number: int) -> Path:
        """The folder of a goal.

        Args:
            number: Number of the goal, from 0.
        """
        return self.acquisition.work_folder / f"{number}-{_file_name(self.goals[number])}"


@dataclass(frozen=True)
class KnownStart:
    """A known skill that another one began with.

    Args:
        skill: Name and digest of the known skill.
        success: Success rate of the known skill before anything was learned.
    """

    skill: str
    success: float


@dataclass(frozen=True)
class SequenceStep:
    """What came of one goal of a sequence.

    Args:
        goal: Name of the goal, or its atoms.
        steps: Environment steps learned for it, all skills together.
        steps_to_level: Environment steps after which ``ENOUGH_IN_A_ROW`` judgements in a row first
            had ``LEVEL`` of the tasks solved; see
            :class:`~slap_ros.acquisition.curriculum.solved_shares.SolvedShares`.
        reached: Whether they ever had; else ``steps_to_level`` are all steps.
        learned: Environment steps of each skill that was learned further, by operator.
        retrieved: Known skill that each of these began with, and its success before, by operator.
        ended: Reason why its acquisition was over, in words.
        tried: Task progress on each goal so far, this one last, by goal.
        solved: Share of the tasks that were solved, for the same goals.
    """

    goal: str
    steps: int
    steps_to_level: int
    reached: bool
    learned: Mapping[str, int]
    retrieved: Mapping[str, KnownStart]
    ended: str
    tried: Mapping[str, float] = field(default_factory=dict)
    solved: Mapping[str, float] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SequenceStep:
        """The step of :meth:`as_json`.

        Raises:
            LookupError, TypeError, ValueError: The data is no step.
        """
        return cls(
            str(data["goal"]),
            int(data["steps"]),
            int(data["steps_to_level"]),
            bool(data["reached"]),
            {str(name): int(steps) for name, steps in dict(data["learned"]).items()},
            {str(name): KnownStart(**one) for name, one in dict(data["retrieved"]).items()},
            str(data["ended"]),
            _numbers(data["tried"]),
            _numbers(data["solved"]),
        )


def _numbers(data: Any) -> dict[str, float]:
    return {str(goal): float(value) for goal, value in dict(data).items()}


def acquire_sequence(
    request: SequenceRequest,
    jobs: int | None,
    ray: str | None,
    watch: AcquisitionWatch,
    on_goal: Callable[[int, str], None] = lambda *_: None,
) -> list[SequenceStep]:
    """Acquire skills for one goal after another, and save the library after each.

    Interrupted, it continues where it was when it is called with the same arguments.

    Args:
        request: Request: the goals, and how skills are acquired.
        jobs: Number of processes; None for this one.
        ray: Address of a Ray cluster to run on instead.
        watch: Functions that are called while skills are acquired.
        on_goal: Function that receives the number of each goal, from 0, and the goal, as its
            acquisition begins.

    Returns:
        What came of each goal, in their order.

    Raises:
        InvalidParameterError: The work folder has another sequence, or is damaged.
    """
    base = request.acquisition
    WorkFolder(base.work_folder).require_same(_described(request))
    steps: list[SequenceStep] = []
    library = SkillLibrary(base.domain.name)
    known: _Tries = {}
    trainings: dict[str, Path] = {}
    for number, goal in enumerate(request.goals):
        on_goal(number, goal)
        before = library if not request.scratch else SkillLibrary(base.domain.name)
        acquisition = replace(request.acquisition_of(number), continued=dict(trainings))
        library, measured = _one_goal(acquisition, jobs, ray, watch)
        if not request.scratch:
            trainings |= _trainings_of(acquisition, before, library)
        known = known if library.digest == before.digest else {}
        known = _tried(request, number, known, jobs, watch)
        steps.append(_step(goal, before, library.record, measured, known))
        sequence = {
            "command": request.command,
            "scratch": request.scratch,
            "goals": [step.as_json() for step in steps],
            "to_come": list(request.goals[number + 1 :]),
        }
        record = {**library.record, "sequence": sequence}
        save_skill_library(base.library_folder, replace(library, record=record))
    return steps


def _trainings_of(
    acquisition: AcquisitionRequest, before: SkillLibrary, library: SkillLibrary
) -> dict[str, Path]:
    """The folders in which an acquisition learned skills that are in its library, by operator.

    Args:
        acquisition: Request for the acquisition.
        before: Library that was kept.
        library: Library of the acquisition.
    """
    work = CurriculumFolder(acquisition.work_folder)
    kept = {SkillLibrary(before.domain, (skill,)).digest for skill in before.skills}
    return {
        skill.operator.name: work.training(skill.operator.name, skill.record["attempts"] - 1)
        for skill in library.skills
        if SkillLibrary(library.domain, (skill,)).digest not in kept
    }


def _described(request: SequenceRequest) -> dict[str, Any]:
    """All that the results depend on, as JSON."""
    return {
        "acquisition": replace(request.acquisition_of(0), goal=None, keep=None).command,
        "goals": list(request.goals),
        "scratch": request.scratch,
        "tasks": request.tasks,
    }


def _step(
    goal: str,
    before: SkillLibrary,
    record: Mapping[str, Any],
    measured: CurveCallback,
    tries: _Tries,
) -> SequenceStep:
    """What came of a goal.

    Args:
        goal: Name of the goal, or its atoms.
        before: Library that was carried on.
        record: Record of the library after the goal.
        measured: Measurements of the acquisition.
        tries: What came of the tasks of all goals so far with that library.
    """
    solved = {name: fmean(one == 1.0 for one in tasks) for name, tasks in tries.items()}
    judged = [*measured.solved.points, Point(record["steps"], solved[goal])]
    steps, reached = steps_to(judged, LEVEL, ENOUGH_IN_A_ROW)
    known = {skill.operator.name: skill.folder_name for skill in before.skills}
    learned = {name: points for name, points in measured.curves.items() if name != PLAN}
    return SequenceStep(
        goal,
        record["steps"],
        steps,
        reached,
        {name: points[-1].steps for name, points in learned.items()},
        {
            name: KnownStart(known[name], points[0].success)
            for name, points in learned.items()
            if name in known
        },
        record["ended"],
        {name: fmean(tasks) for name, tasks in tries.items()},
        solved,
    )


def _one_goal(
    acquisition: AcquisitionRequest, jobs: int | None, ray: str | None, watch: AcquisitionWatch
) -> tuple[SkillLibrary, CurveCallback]:
    """Acquire what one goal needs, and take note of what that took."""
    curves: list[CurveCallback] = []
    segment_steps = acquisition.chosen_settings().segment_steps(horizon_of(acquisition.domain))

    @contextmanager
    def watched() -> Iterator[CurriculumCallback]:
        with watch.curriculum() as inner:
            curves.append(CurveCallback(inner, segment_steps))
            yield curves[-1]

    library = carry_out(acquisition, jobs, ray, replace(watch, curriculum=watched))
    return library, curves[-1]


def _tried(
    request: SequenceRequest, number: int, known: _Tries, jobs: int | None, watch: AcquisitionWatch
) -> dict[str, list[float]]:
    """What comes of the tasks of all goals up to one, with the library after it.

    Args:
        request: Request of the sequence.
        number: Number of the goal.
        known: What came of goals before with the same library, which would be the same again.
        jobs: Number of processes; None for this one.
        watch: Functions that are called.
    """
    base, folder, goals = request.acquisition.domain, request.folder(number), request.goals
    so_far = goals[: number + 1]

    def try_goals(finished: FinishedJobs) -> dict[str, list[float]]:
        choice = DomainChoice(base.name, base.preset, str(folder / "library"))
        new = [goal for goal in so_far if goal not in known]
        work = [(choice, goal, request.tasks) for goal in new]
        with some_workers(jobs) as workers, watch.curriculum() as callback:
            found = run_in_order(workers, try_goal, work, "trying all goals", callback, finished)
        return {**known, **dict(zip(new, found, strict=True))}

    def read(data: Any) -> dict[str, list[float]]:
        return {goal: list(map(float, data[goal])) for goal in so_far}

    return cached_jobs(WorkFolder(folder), "tried", try_goals, read)


def try_goal(choice: DomainChoice, goal: str, tasks: int) -> list[float]:
    """Carry out plans for tasks of a goal.

    Args:
        choice: Domain with the library whose skills are tried.
        goal: Name of the goal, or its atoms.
        tasks: Number of tasks.

    Returns:
        The task progress of each task.
    """
    domain = choice.make()
    skills = {n: skill for n, skill in domain.skills.items() if isinstance(skill, LearnedSkill)}
    rollouts = [
        roll_out(
            domain,
            task_with_goal(domain, SEQUENCE_SEED, index, goal),
            index,
            domain.operators,
            skills,
        )
        for index in range(tasks)
    ]
    return [rollout.progress for rollout in rollouts]


def _file_name(goal: str) -> str:
    """A goal as the name of a file: letters and digits of it, and what is between them as one."""
    words = "".join(letter if letter.isalnum() else " " for letter in goal).split()
    return "-".join(words)[:60]
