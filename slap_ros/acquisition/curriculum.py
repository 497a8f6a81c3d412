# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""LG-SAIL's Algorithm 1: the plan is the curriculum.

Carry out plans with the skills at hand, train what fails from where it failed, judge, and again,
until nothing fails. Skills that do not fail are never trained. Every result is kept in a work
folder, so that the same command continues where it was interrupted::

    runs/skills/points-training/
      settings.json            what is acquired
      iteration0/rollouts.json, fresh.json
      iteration0/Pick.json     how the round of this skill went
      Pick/                    its training; see skill_training
      vacuity.json
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from statistics import fmean
from typing import Any, Protocol

from slap_ros.acquisition import jobs
from slap_ros.acquisition.jobs import InitiationRecord, initiation_record
from slap_ros.acquisition.retrieval import MetricSignatureEncoder, SkillEncoder, nearest
from slap_ros.acquisition.rollouts import PlanRollout, Stage, StageEnd
from slap_ros.acquisition.settings import AcquisitionSettings
from slap_ros.acquisition.skill_library import (
    AcquiredSkill,
    SkillLibrary,
    load_skill,
    operator_digest,
)
from slap_ros.acquisition.skill_training import Round
from slap_ros.acquisition.task_source import ROLLOUTS, VALIDATION, TaskSource
from slap_ros.errors import InvalidParameterError, UnsolvableError
from slap_ros.learning.mlp_policy import MlpPolicy
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import Workers, in_order
from slap_ros.relational import LiftedOperator
from slap_ros.versions import versions

TWICE = 2  # enough progress in a row


class CurriculumCallback(Protocol):
    """Receives the events of a curriculum."""

    def on_progress(self, what: str, done: int, total: int) -> None:
        """Some of a step's jobs are done.

        Args:
            what: The step, in words.
            done: Jobs done so far; 0 as the step begins.
            total: Jobs of the step.
        """
        ...

    def on_rollouts(self, iteration: int, progress: float, failures: dict[str, int]) -> None:
        """Plans were carried out.

        Args:
            iteration: From 0.
            progress: Mean task progress.
            failures: How often each operator's stage failed.
        """
        ...

    def on_judged(self, iteration: int, skill: str, outcome: Round) -> None:
        """A skill was trained for a round.

        Args:
            iteration: From 0.
            skill: The operator's name.
            outcome: How it went.
        """
        ...


@dataclass
class _SkillState:
    """What is known of one operator's skill.

    Args:
        rounds: Learned so far.
        success: Of the best checkpoint, as last judged; below 0 before the first judgement.
        stale: Rounds in a row without progress.
        starts: Digest of the start states of the last round.
        steps: Environment steps learned.
        beginning: What its first round began with, for the record.
    """

    rounds: int = 0
    success: float = -1.0
    stale: int = 0
    starts: str = ""
    steps: int = 0
    beginning: dict[str, Any] = field(default_factory=dict)


@dataclass
class Curriculum:
    """The acquisition of all skills that the tasks of a source take.

    Args:
        source: Of tasks, operators and rewards.
        settings: All hyper-parameters.
        folder: Its work folder.
        workers: Where jobs run.
        callback: Receives its events.
        known: Skills that new ones may begin with, by the path of their folders.
        encoder: Gives operators the keys by which these are found.
    """

    source: TaskSource
    settings: AcquisitionSettings
    folder: Path
    workers: Workers
    callback: CurriculumCallback
    known: dict[str, AcquiredSkill] = field(default_factory=dict)
    encoder: SkillEncoder = field(default_factory=MetricSignatureEncoder)

    def __post_init__(self) -> None:
        self._work = WorkFolder(self.folder)
        self._domain = self.source.make_domain()
        self._operators = {operator.name: operator for operator in self.source.operators()}
        self._states = {name: _SkillState() for name in self._operators}
        self._progress: list[float] = []
        self._left: dict[str, Any] = {}  # what could not be learned, and why

    def run(self) -> SkillLibrary:
        """Acquire until nothing fails, progress is enough twice, or the budget is spent.

        Returns:
            The skills; the record says why it ended.

        Raises:
            InvalidParameterError: The folder has another curriculum, or is damaged.
            UnsolvableError: No task has a plan.
        """
        self._require_same_settings()
        iteration = 0
        while True:
            rollouts = self._carry_out(iteration, "rollouts", self._rollout_tasks(iteration))
            self._require_plans(rollouts)
            self._progress.append(fmean(rollout.progress for rollout in rollouts))
            failures = Counter(stage.operator for stage in _failures(rollouts))
            self.callback.on_rollouts(iteration, self._progress[-1], dict(failures))
            ended = self._ended(failures)
            if ended:
                return self._library(ended, iteration)
            fresh = self._carry_out(iteration, "fresh", self._fresh_tasks())
            if not self._train(iteration, rollouts, fresh, failures):
                return self._library("no progress", iteration)
            iteration += 1

    def _ended(self, failures: Counter[str]) -> str:
        """Why the curriculum is over; empty where it is not."""
        if not failures:
            return "nothing fails"
        latest = self._progress[-TWICE:]
        if len(latest) == TWICE and min(latest) >= self.settings.progress:
            return "progress is enough"
        if self._steps_left() < self.settings.segment_steps(jobs.horizon_of(self._domain)):
            return "the budget is spent"
        return ""

    # -- carrying out plans -----------------------------------------------------------------------

    def _rollout_tasks(self, iteration: int) -> range:
        first = ROLLOUTS + iteration * self.settings.rollouts
        return range(first, first + self.settings.rollouts)

    def _fresh_tasks(self) -> range:
        return range(VALIDATION, VALIDATION + self.settings.validation)

    def _carry_out(self, iteration: int, name: str, tasks: range) -> list[PlanRollout]:
        work = [(self.source, index, self._skills()) for index in tasks]
        return self._work.cached(
            f"iteration{iteration}/{name}",
            lambda: self._run_jobs("carrying out plans", jobs.carry_out, work),
            lambda data: [PlanRollout.from_json(one) for one in data],
        )

    def _require_plans(self, rollouts: Sequence[PlanRollout]) -> None:
        """Leave out tasks without a plan, as long as some have one."""
        without = [rollout for rollout in rollouts if rollout.unplanned]
        if len(without) == len(rollouts):
            goal = self.source.goal or "its own goal"
            raise UnsolvableError(
                f"none of {len(rollouts)} tasks of {self.source.domain} has a plan for {goal}: "
                f"{without[0].unplanned}; give other operators, or another goal"
            )

    def _skills(self) -> dict[str, str]:
        """The folders of the skills at hand, by operator name."""
        return {
            name: str(self._skill_folder(name))
            for name, state in self._states.items()
            if state.rounds
        }

    def _skill_folder(self, name: str) -> Path:
        digest = operator_digest(self._operators[name])
        return self.folder / name / f"{name}-{digest}"

    # -- training ---------------------------------------------------------------------------------

    def _train(
        self,
        iteration: int,
        rollouts: Sequence[PlanRollout],
        fresh: Sequence[PlanRollout],
        failures: Counter[str],
    ) -> bool:
        """Train what failed; whether there was anything left to be trained.

        Args:
            iteration: From 0.
            rollouts: On training tasks.
            fresh: On tasks that training never sees.
            failures: How often each operator's stage failed.
        """
        chosen = [name for name, _ in failures.most_common() if self._may_train(name, rollouts)]
        if not chosen:
            return False
        chosen = sorted(chosen[: max(1, self._steps_left() // self.settings.skill_steps)])
        share = min(self.settings.skill_steps, self._steps_left() // len(chosen))
        settings = replace(self.settings, skill_steps=share)
        work = [self._job(name, settings, rollouts, fresh) for name in chosen]
        outcomes = self._work.cached(
            f"iteration{iteration}/rounds",
            lambda: self._run_jobs("learning skills", jobs.learn, work),
            lambda data: [_round(one) for one in data],
        )
        for name, outcome in zip(chosen, outcomes, strict=True):
            self._take(name, outcome, rollouts)
            self.callback.on_judged(iteration, name, outcome)
        return True

    def _may_train(self, name: str, rollouts: Sequence[PlanRollout]) -> bool:
        """Whether there are states to learn from, and a hope that it is worth while."""
        failed, succeeded = _starts(name, rollouts)
        if not failed:
            self._left[name] = {"why": StageEnd.NOT_APPROACHED.value}
            return False
        state = self._states[name]
        if state.stale < self.settings.patience:
            return True
        changed = state.starts != _digest(failed + succeeded)
        new = changed and len(self._progress) > 1 and self._progress[-1] > self._progress[-2]
        if not new:
            ends = Counter(s.end for s in _failures(rollouts) if s.operator == name)
            atoms = Counter(a for s in _failures(rollouts) if s.operator == name for a in s.atoms)
            self._left[name] = {
                "why": "no progress",
                "states": len(failed),
                "ends": dict(ends),
                "atoms": dict(atoms.most_common(3)),
            }
        return new

    def _job(
        self,
        name: str,
        settings: AcquisitionSettings,
        rollouts: Sequence[PlanRollout],
        fresh: Sequence[PlanRollout],
    ) -> tuple[Any, ...]:
        """The arguments of :func:`slap_ros.acquisition.jobs.learn`.

        Args:
            name: Of the operator.
            settings: With the steps that are left for it.
            rollouts: On training tasks.
            fresh: On tasks that training never sees.
        """
        failed, succeeded = _starts(name, rollouts)
        share = self.settings.rehearsal
        rehearsed = succeeded[: round(len(failed) * share / (1.0 - share))]
        judged = [start for part in _starts(name, fresh) for start in part]
        state = self._states[name]
        return (
            self.source,
            name,
            state.rounds,
            failed + rehearsed,
            judged[: self.settings.judged],
            settings,
            str(self.folder / name),
            None if state.rounds else self._beginning(name),
        )

    def _beginning(self, name: str) -> MlpPolicy | None:
        """The policy of the known skill that a first round begins with; None for none."""
        operator: LiftedOperator = self._operators[name]
        keys = {path: self.encoder.encode(skill.operator) for path, skill in self.known.items()}
        found = nearest(self.encoder.encode(operator), keys)
        if found is None or found[1] < self.settings.least_similarity:
            return None
        path, similarity = found
        self._states[name].beginning = {
            "skill": self.known[path].folder_name,
            "similarity": round(similarity, 3),
        }
        return self.known[path].policy

    def _take(self, name: str, outcome: Round, rollouts: Sequence[PlanRollout]) -> None:
        """Take note of a round."""
        state = self._states[name]
        better = outcome.success > max(outcome.initial, state.success if state.rounds else -1.0)
        state.stale = 0 if better else state.stale + 1
        state.starts = _digest([start for part in _starts(name, rollouts) for start in part])
        if not state.rounds and state.beginning:
            state.beginning["success"] = outcome.initial
        state.rounds += 1
        state.success = outcome.success
        horizon = jobs.horizon_of(self._domain)
        state.steps += len(outcome.segments) * self.settings.segment_steps(horizon)

    def _steps_left(self) -> int:
        return self.settings.total_steps - sum(state.steps for state in self._states.values())

    # -- the result -------------------------------------------------------------------------------

    def _library(self, ended: str, iteration: int) -> SkillLibrary:
        learned = [name for name, state in self._states.items() if state.rounds]
        fresh = self._carry_out(iteration, "final", self._fresh_tasks()) if learned else []
        vacuity = self._vacuity(learned, fresh)
        skills = []
        for name in learned:
            skill = load_skill(self._skill_folder(name), self._domain)
            state = self._states[name]
            record = {
                "success": state.success,
                "vacuity": vacuity[name],
                "steps": state.steps,
                "rounds": state.rounds,
                "seed": self.source.seed,
                "began_with": state.beginning,
            }
            skills.append(
                AcquiredSkill(skill.operator, skill.template, skill.policy, skill.horizon, record)
            )
        record = {
            "preset": self.source.preset,
            "goal": self.source.goal,
            "seed": self.source.seed,
            "ended": ended,
            "left": self._left if ended == "no progress" else {},
            "progress": self._progress,
            "progress_on_fresh_tasks": fmean(r.progress for r in fresh) if fresh else 1.0,
            "steps": sum(state.steps for state in self._states.values()),
            "settings": asdict(self.settings),
            "versions": dict(versions()),
        }
        ordered = sorted(skills, key=lambda skill: skill.folder_name)
        return SkillLibrary(self.source.domain, tuple(ordered), record)

    def _vacuity(self, names: Sequence[str], fresh: Sequence[PlanRollout]) -> dict[str, Any]:
        starts = {name: [s for part in _starts(name, fresh) for s in part] for name in names}
        begun = [name for name in names if starts[name]]
        work = [(self.source, name, starts[name], self.settings.judged) for name in begun]
        found: list[Any] = self._work.cached(
            "vacuity",
            lambda: self._run_jobs("trying constant actions", jobs.vacuity, work),
            lambda data: list(data),
        )
        return dict.fromkeys(names) | dict(zip(begun, found, strict=True))

    # -- plumbing ---------------------------------------------------------------------------------

    def _require_same_settings(self) -> None:
        """Refuse a folder with another curriculum."""
        known = sorted(skill.folder_name for skill in self.known.values())
        own = {"source": self.source.as_json(), **asdict(self.settings), "known": known}
        own = json.loads(json.dumps(own))
        if self._work.cached("settings", lambda: own, lambda theirs: theirs) != own:
            raise InvalidParameterError(
                f"{self.folder} has another training; give another folder, or remove this one"
            )

    def _run_jobs(self, what: str, function: Any, work: Sequence[tuple[Any, ...]]) -> list[Any]:
        results = []
        self.callback.on_progress(what, 0, len(work))
        for result in self.workers.run(function, work):
            results.append(result)
            self.callback.on_progress(what, len(results), len(work))
        return in_order(results)


def _round(data: Any) -> Round:
    return Round(
        float(data["initial"]),
        tuple(map(float, data["segments"])),
        int(data["best"]),
        bool(data["over"]),
    )


def _failures(rollouts: Sequence[PlanRollout]) -> list[Stage]:
    return [stage for rollout in rollouts if (stage := rollout.failure) is not None]


def _starts(
    name: str, rollouts: Sequence[PlanRollout]
) -> tuple[list[InitiationRecord], list[InitiationRecord]]:
    """Where an operator's skill began: first where it failed, then where it did not."""
    parts: tuple[list[InitiationRecord], list[InitiationRecord]] = ([], [])
    for rollout in rollouts:
        for stage in rollout.stages:
            if stage.operator == name and stage.state:
                parts[stage.done].append(initiation_record(rollout, stage))
    return parts


def _digest(starts: Sequence[InitiationRecord]) -> str:
    return sha256(json.dumps(sorted(starts)).encode()).hexdigest()
