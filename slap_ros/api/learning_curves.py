# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success over environment steps while skills are acquired: of whole plans, and of each skill."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean

from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback, OngoingRound
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.solved_shares import Point, SolvedShares
from slap_ros.acquisition.training.skill_training import Round

PLAN = "whole plans"  # name of the curve of task progress


def steps_to(points: Sequence[Point], level: float, in_a_row: int = 1) -> tuple[int, bool]:
    """The environment steps after which a level was first measured, and whether it ever was.

    Args:
        points: Measurements of one training, at least one, in order.
        level: Success from which on the level is reached.
        in_a_row: Number of measurements in a row that must have the level; of these, the first
            one's steps are returned. After the last measurement nothing is learned, and it would be
            the same again.

    Returns:
        The steps; those of the whole training where the level was never measured.
    """
    for number, point in enumerate(points):
        if all(one.success >= level for one in points[number : number + in_a_row]):
            return point.steps, True
    return points[-1].steps, False


@dataclass
class CurveCallback:
    """Takes note of every measurement of a curriculum, and passes all events on.

    Args:
        inner: Callback that receives the events as well.
        segment_steps: Environment steps between two judgements of a skill.
        curves: Measurements by name, in the order in which they were made.
        solved: Judgements of whole tasks: see :class:`SolvedShares`.
    """

    inner: CurriculumCallback
    segment_steps: int
    curves: dict[str, list[Point]] = field(default_factory=dict)
    solved: SolvedShares = field(default_factory=SolvedShares)
    _learned: int = 0

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :class:`~slap_ros.acquisition.curriculum.curriculum_callback.CurriculumCallback`."""
        self.inner.on_progress(what, done, total)

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """Take note of task progress."""
        progress = fmean(rollout.progress for rollout in rollouts)
        self.curves.setdefault(PLAN, []).append(Point(self._learned, progress))
        self.solved.carried_out(self._learned, rollouts)
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
        self.solved.learned(self._learned, self.segment_steps, skill, outcome)
        self._learned += len(outcome.segments) * self.segment_steps
        self.inner.on_judged(iteration, skill, outcome)
