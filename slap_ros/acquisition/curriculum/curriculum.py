# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""LG-SAIL's Algorithm 1: the plan is the curriculum.

An iteration of :meth:`Curriculum.run` is one of the algorithm:

- *reset, plan, roll out*: plans are carried out with the skills at hand (``rollouts``);
  with shortcuts, also the skills that a search tries after them (``after_shortcuts``);
- *collect failed skills with their simulator states*: the ``initiation_states`` of rollouts;
- *train them from these states*: those that ``skill_selection`` chooses, each in its
  ``skill_training``; a new one begins with the *retrieved* known skill (``warm_start``), where
  that does something for it: the nearest known ones are tried first;
- a *dead end*, which is ours: what never succeeds is learned from scratch, and what comes before
  it (``dead_ends``);
- *write back*: the best checkpoint is a skill at hand of the next iteration; in the end, a known
  skill that does as well as what was learned from it stays instead (``known_or_learned``);
- *until nothing fails*, or progress is enough twice, or enough tasks are solved
  (``solved_shares``), or the budget is spent.

Skills that do not fail are never trained. What is known between iterations is a
``CurriculumState``. Every result is kept in a ``curriculum_folder``, so that the same command
continues where it was interrupted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from slap_ros.acquisition.curriculum.after_shortcuts import ShortcutsChoice
from slap_ros.acquisition.curriculum.curriculum_callback import CurriculumCallback
from slap_ros.acquisition.curriculum.curriculum_folder import CurriculumFolder
from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState
from slap_ros.acquisition.curriculum.curriculum_steps import CurriculumSteps
from slap_ros.acquisition.curriculum.dead_ends import DeadEnd
from slap_ros.acquisition.curriculum.final_library import FinalLibrary
from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.jobs import LearningJob, horizon_of
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.skill_selection import (
    NO_PROGRESS,
    SkillSelection,
    select_skills,
)
from slap_ros.acquisition.curriculum.skills_at_hand import SkillsAtHand
from slap_ros.acquisition.curriculum.task_source import ROLLOUTS, VALIDATION, TaskSource
from slap_ros.acquisition.training.retrieval import METRICS, MetricSignatureEncoder, SkillEncoder
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_training import rounds_in
from slap_ros.acquisition.training.warm_start import (
    ChosenStart,
    TriedStart,
    WarmStart,
    WarmStarts,
)
from slap_ros.errors import UnsolvableError
from slap_ros.learning.stored_keys import stored
from slap_ros.learning.workers import Workers
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary

TWICE = 2  # iterations in a row with enough progress that end a curriculum


@dataclass
class Curriculum:
    """The acquisition of all skills that the tasks of a source need.

    Args:
        source: Source of tasks, operators and rewards.
        settings: All hyper-parameters of the curriculum.
        folder: Work folder of the curriculum.
        workers: Workers that run the jobs.
        callback: Callback that receives the events of the curriculum.
        known: Skills that new ones may begin with, by the path of their folders.
        kept: Skills that are there already, by the path of their folders. They are used as they
            are, and learned further only where they fail.
        encoder: Encoder that gives operators the keys by which known skills are found.
        shortcuts: Shortcuts after which skills are tried as well; None for no shortcuts.
        continued: Folders of the trainings of kept skills, by operator name. Where these skills are
            learned further, their trainings go on.

    Raises:
        InvalidParameterError: The replay buffer has no room for a segment.
    """

    source: TaskSource
    settings: AcquisitionSettings
    folder: Path
    workers: Workers
    callback: CurriculumCallback
    known: dict[str, AcquiredSkill] = field(default_factory=dict)
    encoder: SkillEncoder = field(default_factory=MetricSignatureEncoder)
    kept: dict[str, AcquiredSkill] = field(default_factory=dict)
    shortcuts: ShortcutsChoice | None = None
    continued: Mapping[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._results = CurriculumFolder(self.folder)
        self._steps = CurriculumSteps(
            self.source, self._results, self.workers, self.callback, self.shortcuts
        )
        horizon = horizon_of(self.source.make_domain())
        self.settings.require_room(horizon)
        self._segment_steps = self.settings.segment_steps(horizon)
        self._operators = {operator.name: operator for operator in self.source.operators()}
        kept_folders = {skill.operator.name: path for path, skill in self.kept.items()}
        self._kept = {name: self.kept[path] for name, path in kept_folders.items()}
        self._at_hand = SkillsAtHand(self._results, self._operators, kept_folders)
        self._begun: dict[str, WarmStart] = {}  # of each skill that began with a known one
        least = self.settings.least_similarity
        self._warm_starts = WarmStarts(self._kept, self.known, self.encoder, least)

    def run(self) -> SkillLibrary:
        """Acquire skills until nothing fails, that is enough, or the budget is spent.

        Returns:
            The library of skills; its record says why the curriculum ended.

        Raises:
            InvalidParameterError: The folder has another curriculum, or is damaged.
            UnsolvableError: No task has a plan.
        """
        self._results.require_same(self._as_json())
        state = CurriculumState.initial(self._operators)
        iteration = 0
        while not (ended := self._iterate(iteration, state)):
            iteration += 1
        final = FinalLibrary(
            self._steps,
            self.settings,
            self._at_hand,
            self._kept,
            self._begun,
            frozenset(self.continued.keys() & self._kept.keys()),
        )
        return final.make(ended, iteration, state, self._stored_settings)

    def _iterate(self, iteration: int, state: CurriculumState) -> str:
        """Carry out plans, and train what fails from where it fails.

        Args:
            iteration: Number of the iteration, from 0.
            state: State of the curriculum, which is updated.

        Returns:
            Why the curriculum is over; empty where it is not.
        """
        tasks = ROLLOUTS.batch(iteration, self.settings.rollouts)
        at_hand = self._at_hand.folders(state)
        rollouts = self._steps.roll_out(iteration, "rollouts", tasks, at_hand)
        require_plans(rollouts, self.source)
        state.task_progress.append(fmean(rollout.progress for rollout in rollouts))
        state.progress_steps.append(state.steps)
        state.solved.carried_out(state.steps, rollouts)
        self.callback.on_rollouts(iteration, rollouts)
        if over := self._why_over(rollouts, state):
            return over
        if state.solved.done(self.settings.solved, in_a_row=1):
            return ""  # judged again in other tasks: what may be enough is not trained further
        unseen = VALIDATION.batch(iteration, self.settings.validation)
        fresh = self._steps.roll_out(iteration, "fresh", unseen, at_hand)
        selection = select_skills(rollouts, state, self.settings)
        state.not_trained = dict(selection.not_trained)
        if not selection.operators:
            return NO_PROGRESS
        self._start_over(iteration, selection.dead_ends, state)
        starts = self._choose_starts(iteration, selection.operators, rollouts, state)
        self._train(iteration, self._rounds(selection, rollouts, fresh, state, starts), state)
        return ""

    def _why_over(self, rollouts: Sequence[PlanRollout], state: CurriculumState) -> str:
        """Why the curriculum is over; empty where it is not."""
        if not any(rollout.plan or rollout.unplanned for rollout in rollouts):
            return "the goal holds at the start of every task"
        if not any(rollout.failure for rollout in rollouts):
            return "nothing fails"
        latest = state.task_progress[-TWICE:]
        if len(latest) == TWICE and min(latest) >= self.settings.progress:
            return "progress is enough"
        if state.solved.done(self.settings.solved):
            return "enough tasks are solved"
        if self._steps_left(state) < self._segment_steps:
            return "the budget is spent"
        return ""

    def _start_over(
        self, iteration: int, dead_ends: Sequence[DeadEnd], state: CurriculumState
    ) -> None:
        """Forget the skills that have led into dead ends, and those that ended there."""
        for dead_end in dead_ends:
            self.callback.on_dead_end(iteration, dead_end)
        state.start_over(name for end in dead_ends for name in (end.before, end.skill))

    def _choose_starts(
        self,
        iteration: int,
        names: Sequence[str],
        rollouts: Sequence[PlanRollout],
        state: CurriculumState,
    ) -> dict[str, ChosenStart]:
        """How skills that are learned for the first time begin; known skills are tried for that.

        Args:
            iteration: Number of the iteration, from 0.
            names: Names of the operators of the selected skills.
            rollouts: Rollouts on training tasks, with the states in which known skills are tried.
            state: State of the curriculum.
        """
        settings, known = self.settings.warm_start, self._warm_starts
        progress = {name: state.skills[name] for name in names}
        new = [name for name, one in progress.items() if not one.rounds and not one.attempt]
        own = {name: known.find_own(self._operators[name]) for name in new}
        chosen = {name: ChosenStart(start) for name, start in own.items() if start is not None}
        near = {
            name: known.find_near(self._operators[name], settings.candidates)
            for name in new
            if name not in chosen
        }
        trials = [
            (name, starts, InitiationStates.of(name, rollouts).all[: settings.trials])
            for name, starts in near.items()
            if starts
        ]
        if not trials:
            return chosen
        found = self._steps.try_known(iteration, trials)
        for (name, starts, _), successes in zip(trials, found, strict=True):
            tried = tuple(map(TriedStart, starts, successes))
            chosen[name] = ChosenStart.among(tried, settings.least_success)
        return chosen

    def _rounds(
        self,
        selection: SkillSelection,
        rollouts: Sequence[PlanRollout],
        fresh: Sequence[PlanRollout],
        state: CurriculumState,
        starts: Mapping[str, ChosenStart],
    ) -> list[LearningJob]:
        """A round of training per selected skill; the first one of a skill begins warm.

        Args:
            selection: Skills to train, and the environment steps for each.
            rollouts: Rollouts on training tasks.
            fresh: Rollouts on tasks that training never sees.
            state: State of the curriculum.
            starts: How skills that are learned for the first time begin, by name.
        """
        settings = replace(self.settings, skill_steps=selection.steps)
        needed = state.solved.needed(settings.solved, selection.operators)
        rounds = []
        for name in selection.operators:
            skill = state.skills[name]
            attempt = skill.attempt
            continued = None if attempt else self.continued.get(name)
            number = skill.rounds + (len(rounds_in(continued)) if continued else 0)
            start = starts.get(name, ChosenStart())
            if start.start is not None:
                self._begun[name] = start.start
            states = InitiationStates.of(name, rollouts), InitiationStates.of(name, fresh)
            if attempt and not skill.rounds:
                states = states[0].for_another, states[1]
            folder = self._results.training(name, attempt)
            rounds.append(
                LearningJob(
                    self.source,
                    name,
                    number,
                    *states,
                    settings,
                    folder,
                    start.start,
                    attempt,
                    start.tried,
                    needed,
                    continued,
                )
            )
        return rounds

    def _train(self, iteration: int, rounds: Sequence[LearningJob], state: CurriculumState) -> None:
        """Train skills for a round each, and take note of how it went."""
        outcomes = self._steps.learn(iteration, rounds, self._steps_left(state))
        for job, outcome in zip(rounds, outcomes, strict=True):
            state.solved.learned(state.steps, self._segment_steps, job.operator, outcome)
            state.skills[job.operator] = state.skills[job.operator].after(job, outcome)
            self.callback.on_judged(iteration, job.operator, outcome)

    def _steps_left(self, state: CurriculumState) -> int:
        return self.settings.total_steps - state.steps

    @property
    def _stored_settings(self) -> dict[str, Any]:
        """All hyper-parameters as JSON, but those on which the training does not depend.

        So other trainings continue in folders of earlier versions, which do not have them.
        """
        settings = stored(self.settings)
        if not (self.known or self.kept):
            settings.pop("warm_start")
        if self.settings.solved == 1.0:
            settings.pop("solved")
        return settings

    def _as_json(self) -> dict[str, Any]:
        """All that the results depend on, as JSON."""
        known = sorted(skill.folder_name for skill in self.known.values())
        data = {"source": self.source.as_json(), **self._stored_settings, "known": known}
        if self.encoder.name != METRICS:
            data["encoder"] = self.encoder.name
        if self.shortcuts is not None:
            data["shortcuts"] = self.shortcuts.digest
        if self.kept:
            data["kept"] = SkillLibrary(self.source.domain.name, tuple(self.kept.values())).digest
        if self.continued:
            data["continued"] = sorted(self.continued)
        return data


def require_plans(rollouts: Sequence[PlanRollout], source: TaskSource) -> None:
    """Refuse tasks of which none has a plan; where some have one, the others are left out.

    Raises:
        UnsolvableError: No task has a plan.
    """
    without = [rollout for rollout in rollouts if rollout.unplanned]
    if len(without) == len(rollouts):
        goal = source.goal or "its own goal"
        raise UnsolvableError(
            f"none of {len(rollouts)} tasks of {source.domain.name} has a plan for {goal}: "
            f"{without[0].unplanned}; give other operators, or another goal"
        )
