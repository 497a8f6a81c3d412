# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The jobs that training consists of: functions of plain data, run anywhere in any order."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from time import monotonic, process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import SlapError
from slap_ros.planning.planner import GraphPlanner, Problem
from slap_ros.shortcuts.explore import Explorer, Origin
from slap_ros.shortcuts.library import load_shortcut, save_shortcut
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.repertoire import Repertoire
from slap_ros.shortcuts.settings import TRAINING_SEED, Exploration, TrainingSettings
from slap_ros.shortcuts.shortcut import Sampling, Shortcut
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord, find_start
from slap_ros.shortcuts.team import Exercise, practising

if TYPE_CHECKING:
    from slap_ros.shortcuts.ppo import Learner, Progress

CHECKPOINT_S = 30.0  # between checkpoints
WARM_UP = 64  # random steps in each environment, from which observations are normalised
EXPLORATION, STARTS, VALIDATION = 0, 10_000, 90_000  # first task index of each use


@dataclass(frozen=True)
class Place:
    """Which tasks: those of a domain, a preset and a seed."""

    domain: str
    preset: str
    seed: int

    @property
    def task_seed(self) -> int:
        """The seed of training tasks, which evaluation never uses."""
        return TRAINING_SEED + self.seed

    def make(self) -> Domain:
        """The domain."""
        return get_domain(self.domain, self.preset)


def explore(place: Place, index: int, settings: Exploration) -> dict[str, Any]:
    """Explore a task; what :class:`Explored` says, as plain data, and CPU seconds."""
    began = process_time()
    rng = np.random.default_rng([place.seed, EXPLORATION, index])
    explored = Explorer(place.make(), place.task_seed, index, settings, rng).explore()
    return {**explored.as_json(), "cpu_s": process_time() - began}


def start(
    place: Place,
    index: int,
    signature: Signature,
    origin: Origin,
    operator_steps: Mapping[str, float],
) -> dict[str, Any] | None:
    """A start in one task, as plain data."""
    found = find_start(
        place.make(), place.task_seed, STARTS + index, signature, origin, operator_steps
    )
    return None if found is None else found.as_json()


def plan_length(
    place: Place, index: int, shortcuts: tuple[Shortcut, ...], sampling: Sampling
) -> int | None:
    """Steps of the plan for a validation task; None where there is none."""
    domain = place.make()
    task = domain.task(place.task_seed, VALIDATION + index)
    problem = Problem.of(domain, task.initial_state)
    source = Repertoire(domain, shortcuts, task.initial_state, sampling) if shortcuts else None
    try:
        result = GraphPlanner(problem, shortcuts=source).plan(
            task.initial_state, problem.model.space.mask(task.goal)
        )
    except SlapError:
        return None
    return result.plan.predicted_steps


def learn(
    place: Place,
    signature: Signature,
    starts: tuple[StartRecord, ...],
    settings: TrainingSettings,
    folder: str,
    processes: int,
) -> Shortcut:
    """Train a shortcut; what it is and how it goes is kept in ``folder``.

    Begun before, it goes on from the last checkpoint; done before, it is read. How many processes
    it uses makes no difference to what is learned.
    """
    from slap_ros.shortcuts.ppo import Learner, normalisation_of  # torch, here alone

    keep = Kept(Path(folder))
    if keep.finished.exists():
        return load_shortcut(keep.shortcut)

    def exercises(stage: int, ppo: PpoSettings) -> list[Exercise]:
        rewards = settings.rewards_in(stage)
        seeds = [(place.seed, len(starts), stage, part) for part in range(ppo.parts)]
        what = (place.domain, place.preset, signature, starts)
        count = ppo.environments // ppo.parts
        return [Exercise(*what, count, settings.horizon, rewards, seed) for seed in seeds]

    rng = np.random.default_rng([place.seed, len(starts)])
    normalisation = normalisation_of(exercises(0, settings.ppo)[0].begin(), rng, WARM_UP)
    watch = Watch(keep)
    learner: Learner | None = None
    for stage, ppo in enumerate(settings.stages):
        with practising(exercises(stage, ppo), processes) as episodes:
            earlier, learner = learner, Learner(episodes, normalisation, ppo, place.seed)
            if earlier is not None:
                learner.inherit(earlier)
            if keep.checkpoint(stage).exists():
                learner.resume(keep.checkpoint(stage))
            learner.learn(watch.of(stage, learner), keep.path / "tensorboard")
            learner.save(keep.checkpoint(stage))
    assert learner is not None  # there is one stage at least
    shortcut = Shortcut(signature, learner.policy(), learner.shortest, watch.record())
    save_shortcut(keep.shortcut, shortcut)
    keep.finished.touch()
    return shortcut


class Watch:
    """Writes down how a training goes, and has checkpoints made."""

    def __init__(self, keep: Kept) -> None:
        self._keep = keep
        self._began = self._saved = monotonic()
        self._cpu_s = _cpu_s()
        self._latest: dict[int, Progress] = {}

    def of(self, stage: int, learner: Learner) -> Callable[[Progress], bool]:
        """What is called after each rollout of a stage."""

        def report(progress: Progress) -> bool:
            self._latest[stage] = progress
            seconds = monotonic() - self._began
            self._keep.append({"stage": stage, **asdict(progress), "seconds": seconds})
            if monotonic() - self._saved > CHECKPOINT_S:
                learner.save(self._keep.checkpoint(stage))
                self._saved = monotonic()
            return True

        return report

    def record(self) -> dict[str, str | int | float]:
        """Figures by name; success and length over the last episodes, with noise."""
        if not self._latest:  # all stages were over before
            return {}
        last = self._latest[max(self._latest)]
        return {
            "environment_steps": sum(progress.steps for progress in self._latest.values()),
            "episodes": sum(progress.episodes for progress in self._latest.values()),
            "success": last.success,
            "length": last.length if last.length == last.length else -1.0,
            "cpu_s": _cpu_s() - self._cpu_s,
        }


def _cpu_s() -> float:
    """Of this process, and of those that it started and that have ended."""
    return sum(os.times()[:4])


@dataclass(frozen=True)
class Kept:
    """What a training keeps on disk."""

    path: Path

    def __post_init__(self) -> None:
        self.path.mkdir(parents=True, exist_ok=True)

    @property
    def shortcut(self) -> Path:
        """What was learned, as in a library. The folder is named for the signature there."""
        return self.path / self.path.name

    def checkpoint(self, stage: int) -> Path:
        """PPO's state in a stage."""
        return self.path / f"checkpoint{stage}.pt"

    @property
    def finished(self) -> Path:
        """Exists once training is over."""
        return self.path / "finished"

    @property
    def progress(self) -> Path:
        """A JSON object a line, one for each rollout."""
        return self.path / "progress.jsonl"

    def append(self, progress: Mapping[str, Any]) -> None:
        """Tell how it goes; NaN where there is no number yet, as null."""
        plain = {k: None if v != v else v for k, v in progress.items()}
        with self.progress.open("a", encoding="utf-8") as file:
            file.write(json.dumps(plain) + "\n")
