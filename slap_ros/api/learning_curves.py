# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success over environment steps while skills are acquired: of whole plans, and of each skill."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import NamedTuple

from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback, OngoingRound
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.rollouts import PlanRollout
from slap_ros.acquisition.training.skill_training import Round

PLAN = "whole plans"  # name of the curve of task progress


class Point(NamedTuple):
    """A measurement while skills are acquired."""

    steps: int  # environment steps learned before: of all skills for plans, else of the skill
    success: float  # task progress of plans, or success rate of a skill


def steps_to(points: Sequence[Point], level: float) -> tuple[int, bool]:
    """The environment steps after which a level was first measured, and whether it ever was.

    Args:
        points: Measurements of one training, at least one, in order.
        level: Success from which on the level is reached.

    Returns:
        The steps; those of the whole training where the level was never measured.
    """
    reached = next((point.steps for point in points if point.success >= level), None)
    return (points[-1].steps, False) if reached is None else (reached, True)


@dataclass
class CurveCallback:
    """Takes note of every measurement of a curriculum, and passes all events on.

    Args:
        inner: Callback that receives the events as well.
        segment_steps: Environment steps between two judgements of a skill.
        curves: Measurements by name, in the order in which they were made.
    """

    inner: CurriculumCallback
    segment_steps: int
    curves: dict[str, list[Point]] = field(default_factory=dict)
    _learned: int = 0

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""
        self.inner.on_progress(what, done, total)

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """Take note of task progress."""
        progress = fmean(rollout.progress for rollout in rollouts)
        self.curves.setdefault(PLAN, []).append(Point(self._learned, progress))
        self.inner.on_rollouts(iteration, rollouts)

    def on_dead_end(self, iteration: int, dead_end: DeadEnd) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""
        self.inner.on_dead_end(iteration, dead_end)

    def on_learning(self, iteration: int, rounds: Sequence[OngoingRound], steps_left: int) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""
        self.inner.on_learning(iteration, rounds, steps_left)

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """Take note of the judgements of a round.

        Args:
            iteration: Number of the iteration, from 0.
            skill: Name of the skill's operator.
            outcome: Outcome of the round.
        """
        points = self.curves.setdefault(skill, [])
        begun = points[-1].steps if points else 0
        for number, success in enumerate((outcome.initial, *outcome.segments)):
            points.append(Point(begun + number * self.segment_steps, success))
        self._learned += len(outcome.segments) * self.segment_steps
        self.inner.on_judged(iteration, skill, outcome)
