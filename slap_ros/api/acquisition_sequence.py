# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One task after another, with one library that grows: continual learning (LG-SAIL §5, Fig. 5).

Each goal of a sequence is an acquisition of its own, which keeps the library of the goal before it:
skills that carry out the new goal are used as they are, and learned further where they fail: their
trainings go on, with critics, replay buffers and some of the states of earlier goals. A goal is
over once three judgements in a row had .8 of its tasks solved, unless the setting ``solved`` says
otherwise. After each, all goals so far are tried, so that what was forgotten shows; where it is
asked for, goals that are not done any more are then learned again. A work folder has::

    1-task1/library, 1-task1/training    the library after the second goal, and its work folder
    1-task1/tried.json                   what comes of plans for all goals so far with that library
    1-task1/.tried.jsonl                 the same for each goal, while others are being tried
    1-task1/again-task0                  the same for the first goal, where it is learned again then
    1-task1/tried_again.json             what comes of plans for all goals after that

Interrupted at any time, the same sequence goes on from there. After each goal, its library is also
that of the whole sequence so far.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback
from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.acquisition.training.skill_training import ENOUGH_IN_A_ROW
from slap_ros.api.acquisition import AcquisitionWatch, carry_out
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.jobs import some_workers
from slap_ros.api.learning_curves import PLAN, CurveCallback, steps_to
from slap_ros.api.sequence_request import LEVEL, SequenceRequest
from slap_ros.api.sequence_step import KnownStart, SequenceStep
from slap_ros.core.goals import task_with_goal
from slap_ros.learning.finished_jobs import FinishedJobs, cached_jobs
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import run_in_order
from slap_ros.policies.library_files import SKILL, require_places
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_library import SkillLibrary, save_skill_library

SEQUENCE_SEED = 400  # seed of the tasks that goals are tried in; training and studies use others

_Tries = Mapping[str, list[float]]  # task progress of each task, by goal


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
        InvalidParameterError: The work folder has another sequence, or is damaged; or the library's
            folder has something that is no library, or would have the work folder in it.
    """
    base = request.acquisition
    require_places(base.library_folder, base.work_folder, SKILL)
    WorkFolder(base.work_folder).require_same(request.as_json())
    steps: list[SequenceStep] = []
    learner = _SequenceLearner(request, jobs, ray, watch)
    for number, goal in enumerate(request.goals):
        on_goal(number, goal)
        if request.scratch:
            learner = _SequenceLearner(request, jobs, ray, watch)
        before, folder = learner.library, request.folder(number)
        measured = learner.learn(goal, folder)
        record = learner.library.record
        learner.try_goals(request.goals[: number + 1], folder, "tried")
        step = _step(goal, before, record, measured, learner.tries)
        if request.relearn:
            step = _relearn(request, number, learner, step, on_goal)
        steps.append(step)
        sequence = {
            "command": request.command,
            "scratch": request.scratch,
            "relearn": request.relearn,
            "goals": [step.as_json() for step in steps],
            "to_come": list(request.goals[number + 1 :]),
        }
        record = {**learner.library.record, "sequence": sequence}
        save_skill_library(base.library_folder, replace(learner.library, record=record))
    return steps


@dataclass
class _SequenceLearner:
    """What a sequence has learned so far, and what learns more.

    Args:
        request: Request of the sequence.
        jobs: Number of processes; None for this one.
        ray: Address of a Ray cluster to run on instead.
        watch: Functions that are called while skills are acquired.
        folder: Folder of the library; None for one without skills.
        library: Library of all that was learned so far.
        trainings: Folders of the trainings of its skills, by operator name.
        tries: Task progress of each task tried with the library, by goal.
    """

    request: SequenceRequest
    jobs: int | None
    ray: str | None
    watch: AcquisitionWatch
    folder: Path | None = None
    library: SkillLibrary = field(init=False)
    trainings: dict[str, Path] = field(default_factory=dict)
    tries: dict[str, list[float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.library = SkillLibrary(self.request.acquisition.domain.name)

    def learn(self, goal: str, folder: Path) -> CurveCallback:
        """Carry the library on for a goal.

        Args:
            goal: Name of the goal, or its atoms.
            folder: Folder of the goal.

        Returns:
            What was measured meanwhile.
        """
        asked = self.request.acquisition_of(goal, folder, self.folder)
        asked = replace(asked, continued=dict(self.trainings))
        before = self.library
        self.library, measured = _one_goal(asked, self.jobs, self.ray, self.watch)
        self.folder = asked.library_folder
        self.trainings |= _trainings_of(asked, before, self.library)
        if self.library.digest != before.digest:
            self.tries = {}
        return measured

    def try_goals(self, goals: Sequence[str], folder: Path, name: str) -> None:
        """Try goals, but those that were tried with the same library before.

        Args:
            goals: Names of the goals, or their atoms.
            folder: Folder of the latest goal.
            name: Name of the results' file in it, without its ending.
        """
        domain, known = self.request.acquisition.domain, self.tries
        choice = DomainChoice(domain.name, domain.preset, str(self.folder))

        def carry_out_plans(finished: FinishedJobs) -> dict[str, list[float]]:
            new = [goal for goal in goals if goal not in known]
            work = [(choice, goal, self.request.tasks) for goal in new]
            with some_workers(self.jobs) as workers, self.watch.curriculum() as callback:
                found = run_in_order(
                    workers, try_goal, work, "trying all goals", callback, finished
                )
            return {**known, **dict(zip(new, found, strict=True))}

        def read(data: Any) -> dict[str, list[float]]:
            return {goal: list(map(float, data[goal])) for goal in goals}

        self.tries = cached_jobs(WorkFolder(folder), name, carry_out_plans, read)


def _relearn(
    request: SequenceRequest,
    number: int,
    learner: _SequenceLearner,
    step: SequenceStep,
    on_goal: Callable[[int, str], None],
) -> SequenceStep:
    """Learn earlier goals again that are not done any more, each once, and try all of them again.

    Plans for them are carried out in the tasks of training, and skills learned from where they
    fail, as when a goal is new.

    Args:
        request: Request of the sequence.
        number: Number of the latest goal, from 0.
        learner: What has learned it.
        step: What came of it.
        on_goal: Function that receives the number of each goal that is learned again, and the goal.

    Returns:
        What came of the goal with the library that is carried on now.
    """
    again = {}
    for earlier, goal in enumerate(request.goals[:number]):
        if step.solved[goal] >= request.solved:
            continue
        on_goal(earlier, goal)
        learner.learn(goal, request.folder_again(number, goal))
        again[goal] = int(learner.library.record["steps"])
    if not again:
        return step
    learner.try_goals(request.goals[: number + 1], request.folder(number), "tried_again")
    return replace(step, again=again, tried=_means(learner.tries), solved=_solved(learner.tries))


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
    solved = _solved(tries)
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
        _means(tries),
        solved,
    )


def _means(tries: _Tries) -> dict[str, float]:
    return {goal: fmean(tasks) for goal, tasks in tries.items()}


def _solved(tries: _Tries) -> dict[str, float]:
    return {goal: fmean(task == 1.0 for task in tasks) for goal, tasks in tries.items()}


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
