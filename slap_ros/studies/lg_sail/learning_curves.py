# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trainings of skills as jobs of studies: their success over environment steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum.curriculum import Curriculum
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.solved_shares import Point
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.api.acquisition import UnwatchedCurriculum, acquirable, known_skills
from slap_ros.api.learning_curves import CurveCallback, steps_to
from slap_ros.evaluation.summary import Spread, format_spread
from slap_ros.learning.workers import SequentialWorkers


@dataclass(frozen=True)
class AcquisitionSetup:
    """What skills are acquired for, and how.

    Args:
        domain: Name of the domain.
        preset: Preset of the domain.
        goal: Name of a goal, or atoms; empty for each task's own.
        settings: All hyper-parameters of the curriculum.
    """

    domain: str
    preset: str
    goal: str
    settings: AcquisitionSettings

    def source(self, seed: int) -> TaskSource:
        """The tasks of a training, with the operators and rewards that people wrote.

        Args:
            seed: Seed of the training.
        """
        domain = acquirable(self.domain, self.preset)
        assert domain.acquisition is not None
        return TaskSource.of(
            domain, self.goal, seed, domain.acquisition.operators, domain.acquisition.rewards
        )


@dataclass(frozen=True)
class LearningCurves:
    """The measurements of one training.

    Args:
        curves: Measurements by name: :data:`PLAN`, and each skill that was learned.
        began_with: Known skill that each skill began with, and those that were tried, by name.
        ended: Reason why the training was over, in words.
        progress: Task progress in the end, on tasks that training never saw.
    """

    curves: Mapping[str, tuple[Point, ...]]
    began_with: Mapping[str, Mapping[str, Any]]
    ended: str
    progress: float

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {
            "curves": {name: [list(point) for point in one] for name, one in self.curves.items()},
            "began_with": {name: dict(one) for name, one in self.began_with.items()},
            "ended": self.ended,
            "progress": self.progress,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> LearningCurves:
        """The measurements of :meth:`as_json`."""
        curves = {
            str(name): tuple(Point(int(steps), float(success)) for steps, success in points)
            for name, points in data["curves"].items()
        }
        begun = {str(name): dict(one) for name, one in data["began_with"].items()}
        return cls(curves, begun, str(data["ended"]), float(data["progress"]))


def format_steps_to(trainings: Sequence[Sequence[Point]], level: float) -> str:
    """After how many environment steps a level was first measured, over trainings, in words.

    Args:
        trainings: Measurements of each training, by one measure.
        level: Success from which on the level is reached.
    """
    found = [steps_to(one, level) for one in trainings]
    reached = sum(done for _, done in found)
    spread = format_spread(Spread.of([float(steps) for steps, _ in found]), 0)
    return spread if reached == len(found) else f"≥ {spread} ({reached} of {len(found)} came there)"


def learn_skills(
    setup: AcquisitionSetup, seed: int, known: Sequence[str], folder: str
) -> dict[str, Any]:
    """Acquire the skills of a domain.

    Args:
        setup: Domain, goal and settings of the training; its operators and rewards.
        seed: Seed of all random numbers.
        known: Folders of libraries whose skills new ones may begin with.
        folder: Folder for checkpoints, from which an interrupted training goes on.

    Returns:
        The :class:`LearningCurves` as JSON.
    """
    source = setup.source(seed)
    segment_steps = setup.settings.segment_steps(horizon_of(source.make_domain()))
    callback = CurveCallback(UnwatchedCurriculum(), segment_steps)
    skills = known_skills([Path(path) for path in known], lambda _: None)
    workers = SequentialWorkers()
    curriculum = Curriculum(source, setup.settings, Path(folder), workers, callback, skills)
    library = curriculum.run()
    record = library.record
    began_with = {one.operator.name: dict(one.record["began_with"]) for one in library.skills}
    return LearningCurves(
        {name: tuple(points) for name, points in callback.curves.items()},
        began_with,
        str(record["ended"]),
        float(record["progress_on_fresh_tasks"]),
    ).as_json()
