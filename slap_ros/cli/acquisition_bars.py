# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far ``slap acquire`` is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from rich.progress import BarColumn, TaskID

from slap_ros.acquisition.curriculum.curriculum_callback import OngoingRound
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout, failed_stages
from slap_ros.acquisition.training.skill_training import Round
from slap_ros.cli.acquisition_events import AcquisitionEvents
from slap_ros.cli.console import console
from slap_ros.cli.learning_bars import LearningBars


@dataclass(frozen=True)
class _Iteration:
    """An iteration in which skills are learned.

    Args:
        progress: Task progress of its rollouts.
        rounds: Under way, one per skill.
        steps_left: Environment steps that were left as it began.
    """

    progress: float
    rounds: Sequence[OngoingRound]
    steps_left: int


class AcquisitionBars(LearningBars):
    """Progress for people, and events for whoever reads them."""

    def __init__(self, events: AcquisitionEvents) -> None:
        """Show nothing yet; events are passed on to ``events``."""
        super().__init__(BarColumn(bar_width=15))
        self._events = events
        self._progress = 0.0

    def on_progress(self, what: str, done: int, total: int) -> None:
        """See :meth:`LearningBars.on_progress`."""
        self._events.on_progress(what, done, total)
        super().on_progress(what, done, total)

    def on_rollouts(self, iteration: int, rollouts: Sequence[PlanRollout]) -> None:
        """How far plans got."""
        self._events.on_rollouts(iteration, rollouts)
        self._progress = fmean(rollout.progress for rollout in rollouts)
        failures = Counter(stage.operator for stage in failed_stages(rollouts))
        failed = ", ".join(f"{name} {count} times" for name, count in failures.most_common())
        console.print(
            f"iteration {iteration}: task progress {self._progress:.2f}; failed: "
            f"{failed or 'nothing'}"
        )

    def on_dead_end(self, iteration: int, dead_end: DeadEnd) -> None:
        """Say why skills are learned from scratch.

        Args:
            iteration: From 0.
            dead_end: Names them.
        """
        console.print(
            f"iteration {iteration}: {dead_end.skill} succeeds from nothing that "
            f"{dead_end.before} leaves; both are learned from scratch"
        )

    def on_learning(self, iteration: int, rounds: Sequence[OngoingRound], steps_left: int) -> None:
        """Follow the rounds that begin.

        Args:
            iteration: From 0.
            rounds: One per skill.
            steps_left: Environment steps that all skills together may still learn for.
        """
        self.unfollow()
        followed = _Iteration(self._progress, rounds, steps_left)
        whole = self.bars.add_task(
            f"iteration {iteration}", total=sum(one.steps for one in rounds), detail=""
        )
        bars = {
            one.skill: self.bars.add_task(f"  {one.skill}", total=one.steps, detail="")
            for one in rounds
        }
        self.follow(lambda: self._update(followed, whole, bars), [whole, *bars.values()])

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """What a round of training was worth.

        Args:
            iteration: From 0.
            skill: The operator's name.
            outcome: How it went.
        """
        self.unfollow()
        self._events.on_judged(iteration, skill, outcome)
        console.print(
            f"iteration {iteration}, {skill}: success {outcome.initial:.2f} became "
            f"{outcome.success:.2f} in {len(outcome.segments)} segments"
        )

    # -- inside a round ---------------------------------------------------------------------------

    def _update(self, iteration: _Iteration, whole: TaskID, bars: Mapping[str, TaskID]) -> None:
        """Show how far rounds are.

        Args:
            iteration: Theirs.
            whole: The bar of all of them.
            bars: The bar of each, by skill.
        """
        found = {one.skill: one.so_far() for one in iteration.rounds}
        learned = sum(_steps(one, found[one.skill]) for one in iteration.rounds)
        left = iteration.steps_left - learned
        overall = f"task progress {iteration.progress:.2f}, {left} steps left"
        self.bars.update(whole, completed=learned, detail=overall)
        for one in iteration.rounds:
            judged = found[one.skill]
            if judged is not None:
                detail = _judgement(one, judged)
                self.bars.update(bars[one.skill], completed=_steps(one, judged), detail=detail)


def _judgement(one: OngoingRound, judged: Round) -> str:
    latest = (judged.initial, *judged.segments)[-1]
    steps = f"{_steps(one, judged)} of {one.steps} steps"
    return f"{steps}, success {latest:.2f} (best {judged.success:.2f})"


def _steps(one: OngoingRound, judged: Round | None) -> int:
    """Environment steps of a round so far."""
    return len(judged.segments) * one.segment_steps if judged is not None else 0
