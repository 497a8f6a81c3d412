# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The share of a goal's tasks that are solved, judged again and again while skills are acquired.

A goal is done once three judgements in a row have the share that is asked for (LG-SAIL §5), the
last of them of whole plans. So a skill need not be better than its goal needs it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import NamedTuple

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.training.skill_training import ENOUGH_IN_A_ROW, Round


class Point(NamedTuple):
    """A measurement while skills are acquired."""

    steps: int  # environment steps learned before: of all skills for plans, else of the skill
    success: float  # task progress of plans, or success rate of a skill


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

    def learned(self, steps: int, segment_steps: int, skill: str, outcome: Round) -> None:
        """A skill was trained for a round, and its best checkpoint is used from now on.

        Args:
            steps: Environment steps learned before.
            segment_steps: Environment steps between two judgements.
            skill: Name of the skill's operator.
            outcome: Outcome of the round.
        """
        for number, success in enumerate(outcome.segments, start=1):
            self._success[skill] = success
            self.points.append(Point(steps + number * segment_steps, self._product(self._stages)))
        self._success[skill] = outcome.success

    def done(self, share: float, in_a_row: int = ENOUGH_IN_A_ROW) -> bool:
        """Whether the latest judgements have a share.

        Args:
            share: Share of tasks that are solved.
            in_a_row: Number of judgements; by default as many as make a goal done.
        """
        latest = self.points[-in_a_row:]
        return len(latest) == in_a_row and all(one.success >= share for one in latest)

    def needed(self, share: float, skills: Collection[str]) -> float:
        """The success that each of some skills needs, so that a share of tasks is solved.

        Skills that no plan has come to yet will need the same.

        Args:
            share: Share of tasks to solve.
            skills: Operators of the skills that are to be learned; others stay as they are.

        Returns:
            The same for all of them; above 1 where it does not depend on them alone.
        """
        settled = [name for name in self._success if name not in skills]
        others = self._product(settled)
        own = sum(count for name, count in self._stages.items() if name not in settled)
        return (share / others) ** (1.0 / own) if own and others else math.inf

    def _product(self, skills: Collection[str]) -> float:
        """The share of plans in which all stages of some skills succeed."""
        return math.prod(self._success.get(name, 0.0) ** self._stages[name] for name in skills)
