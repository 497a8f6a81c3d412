# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One task after another, with one library that grows: continual learning (LG-SAIL §5, Fig. 5).

Each goal of a sequence is an acquisition of its own, which keeps the library of the goal before it:
skills that carry out the new goal are used as they are, and learned further where they fail. After
each, all goals so far are tried, so that what was forgotten shows. A folder has::

    0-task0/library, 0-task0/training    the library after the first goal, and its work folder
    0-task0/tried.json                   how far plans for all goals so far get with that library
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.api.acquisition import AcquisitionWatch, carry_out
from slap_ros.api.acquisition_request import AcquisitionRequest
from slap_ros.api.learning_curves import PLAN, CurveCallback, steps_to
from slap_ros.core import Domain
from slap_ros.core.goals import task_with_goal
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.skill import LearnedSkill
from slap_ros.skills.skill_library import SkillLibrary, save_skill_library

SEQUENCE_SEED = 400  # seed of the tasks that goals are tried in; training and studies use others
LEVEL = 0.8  # task progress up to which steps are counted


@dataclass(frozen=True)
class SequenceRequest:
    """A sequence of goals, and how skills are acquired for them.

    Args:
        acquisition: Request for the acquisitions, whose goal and library to keep do not count; its
            folders are those of the whole sequence.
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


@dataclass(frozen=True)
class SequenceStep:
    """What came of one goal of a sequence.

    Args:
        goal: Name of the goal, or its atoms.
        steps: Environment steps learned for it, all skills together.
        steps_to_level: Environment steps after which task progress of ``LEVEL`` was first measured.
        reached: Whether it ever was; else ``steps_to_level`` are all steps.
        learned: Environment steps of each skill that was learned further, by operator.
        ended: Reason why its acquisition was over, in words.
        tried: Task progress on each goal so far, this one last, by goal.
    """

    goal: str
    steps: int
    steps_to_level: int
    reached: bool
    learned: Mapping[str, int]
    ended: str
    tried: Mapping[str, float] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {**asdict(self), "learned": dict(self.learned), "tried": dict(self.tried)}

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
            str(data["ended"]),
            {str(goal): float(progress) for goal, progress in dict(data["tried"]).items()},
        )


def acquire_sequence(
    request: SequenceRequest,
    jobs: int | None,
    ray: str | None,
    watch: AcquisitionWatch,
) -> list[SequenceStep]:
    """Acquire skills for one goal after another, and save the last library.

    Interrupted, it continues where it was when it is called with the same arguments.

    Args:
        request: Request: the goals, and how skills are acquired.
        jobs: Number of processes; None for this one.
        ray: Address of a Ray cluster to run on instead.
        watch: Functions that are called while skills are acquired.

    Returns:
        What came of each goal, in their order.

    Raises:
        InvalidParameterError: The work folder has another sequence, or is damaged.
    """
    base = request.acquisition
    WorkFolder(base.work_folder).require_same(_described(request))
    steps: list[SequenceStep] = []
    library = SkillLibrary(base.domain.name)
    for number, goal in enumerate(request.goals):
        folder = base.work_folder / f"{number}-{_file_name(goal)}"
        keep = _library_of(request, number - 1) if steps and not request.scratch else None
        acquisition = replace(
            base,
            goal=goal,
            keep=keep,
            library_folder=folder / "library",
            work_folder=folder / "training",
        )
        library, step = _one_goal(acquisition, jobs, ray, watch)
        steps.append(replace(step, tried=_tried(request, number, folder)))
    sequence = {"scratch": request.scratch, "goals": [step.as_json() for step in steps]}
    record = {**library.record, "sequence": sequence}
    save_skill_library(base.library_folder, replace(library, record=record))
    return steps


def _described(request: SequenceRequest) -> dict[str, Any]:
    """All that the results depend on, as JSON."""
    return {
        "acquisition": replace(request.acquisition, goal=None, keep=None).command,
        "goals": list(request.goals),
        "scratch": request.scratch,
        "tasks": request.tasks,
    }


def _library_of(request: SequenceRequest, number: int) -> Path:
    """The folder of the library after a goal."""
    name = f"{number}-{_file_name(request.goals[number])}"
    return request.acquisition.work_folder / name / "library"


def _one_goal(
    acquisition: AcquisitionRequest, jobs: int | None, ray: str | None, watch: AcquisitionWatch
) -> tuple[SkillLibrary, SequenceStep]:
    """Acquire what one goal needs, and take note of what that took."""
    curves: list[CurveCallback] = []
    segment_steps = acquisition.chosen_settings().segment_steps(horizon_of(acquisition.domain))

    @contextmanager
    def watched() -> Iterator[CurriculumCallback]:
        with watch.curriculum() as inner:
            curves.append(CurveCallback(inner, segment_steps))
            yield curves[-1]

    library = carry_out(acquisition, jobs, ray, replace(watch, curriculum=watched))
    found = curves[-1].curves
    steps, reached = steps_to(found[PLAN], LEVEL)
    learned = {name: points[-1].steps for name, points in found.items() if name != PLAN}
    record = library.record
    goal = acquisition.goal_or_first
    return library, SequenceStep(goal, record["steps"], steps, reached, learned, record["ended"])


def _tried(request: SequenceRequest, number: int, folder: Path) -> dict[str, float]:
    """Task progress on all goals up to one, with the library after it; read where it is there."""
    goals = request.goals[: number + 1]
    return WorkFolder(folder).cached("tried", lambda: _try(request, goals, folder), dict)


def _try(request: SequenceRequest, goals: Sequence[str], folder: Path) -> dict[str, float]:
    """Task progress on goals with the library in a folder."""
    base = request.acquisition.domain
    domain = open_domain(DomainChoice(base.name, base.preset, str(folder / "library")))
    return {goal: _progress(domain, goal, request.tasks) for goal in goals}


def _progress(domain: Domain, goal: str, tasks: int) -> float:
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
    return fmean(rollout.progress for rollout in rollouts)


def _file_name(goal: str) -> str:
    """A goal as the name of a file: letters and digits of it, and what is between them as one."""
    words = "".join(letter if letter.isalnum() else " " for letter in goal).split()
    return "-".join(words)[:60]
