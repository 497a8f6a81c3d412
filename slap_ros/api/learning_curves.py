# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success over environment steps while skills are acquired: of whole plans, and of each skill."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import prod
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
class SolvedShares:
    """Judgements of whole tasks while skills are acquired: the share whose plans succeed.

    Between rounds of training, whole plans are carried out. Within a round, a skill is judged from
    states that plans come to, so that the share of plans that succeed is the product, over the
    stages of a plan, of the success of their skills.

    Args:
        points: Judgements in order, over the environment steps of all skills together.
    """

    points: list[Point] = field(default_factory=list)
    _stages: Counter[str] = field(default_factory=Counter)  # of a plan, by operator
    _success: dict[str, float] = field(default_factory=dict)  # of the newest weights, by operator

    def carried_out(self, steps: int, rollouts: Sequence[PlanRollout]) -> None:
        """Whole plans were carried out.

        Args:
            steps: Environment steps learned before.
            rollouts: Rollouts of plans, one per task.
        """
        begun = [stage for rollout in rollouts for stage in rollout.stages]
        tried = Counter(stage.operator for stage in begun)
        done = Counter(stage.operator for stage in begun if stage.done)
        plan = max((rollout.plan for rollout in rollouts), key=len)
        self._stages = Counter(text.partition("(")[0] for text in plan)
        self._success = {name: done[name] / tried[name] for name in tried}
        self.points.append(Point(steps, fmean(rollout.progress == 1.0 for rollout in rollouts)))

    def judged(self, steps: int, skill: str, success: float) -> None:
        """A checkpoint of a skill was judged.

        Args:
            steps: Environment steps learned before.
            skill: Name of the skill's operator.
            success: Success rate of the checkpoint.
        """
        self.kept(skill, success)
        each = [self._success.get(name, 0.0) ** count for name, count in self._stages.items()]
        self.points.append(Point(steps, prod(each)))

    def kept(self, skill: str, success: float) -> None:
        """A checkpoint of a skill is used from now on.

        Args:
            skill: Name of the skill's operator.
            success: Success rate of the checkpoint.
        """
        self._success[skill] = success


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
            if number:
                self.solved.judged(self._learned + number * self.segment_steps, skill, success)
        self.solved.kept(skill, outcome.success)
        self._learned += len(outcome.segments) * self.segment_steps
        self.inner.on_judged(iteration, skill, outcome)
