# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training a library: explore, rank, learn, keep what shortens plans, and again (SLAP §4.2).

Everything is kept in a folder as it is done, so that the same command goes on where it was
interrupted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import Any, Protocol, TypeVar

from slap_ros.errors import InvalidParameterError
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.explore import Explored, Find, Origin
from slap_ros.shortcuts.jobs import Place
from slap_ros.shortcuts.library import Library
from slap_ros.shortcuts.settings import TrainingSettings
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.signature import Pattern, Signature
from slap_ros.shortcuts.starts import StartRecord
from slap_ros.shortcuts.workers import Workers, in_order
from slap_ros.versions import versions


class Audience(Protocol):
    """Is told how training goes."""

    def counting(self, what: str, done: int, total: int) -> None:
        """So many jobs of a kind are done."""
        ...

    def candidates(self, ranked: Sequence[Candidate]) -> None:
        """What was found worth learning."""
        ...

    def learning(self, name: str, folder: Path, total_steps: int) -> None:
        """A shortcut is being learned; its progress is in the folder."""
        ...

    def judged(self, name: str, before: float, after: float, kept: bool) -> None:
        """Mean plan length on validation tasks without and with it."""
        ...


@dataclass(frozen=True)
class Candidate:
    """Finds of several tasks that are the same up to objects: one learning problem.

    Args:
        signature: Of the find that occurred most.
        origin: Where from.
        tasks: In how many explored tasks it was found.
        promise: Part of a plan's length that it would save, mean over all explored tasks.
    """

    signature: Signature
    origin: Origin
    tasks: int
    promise: float


Result = TypeVar("Result")
# What decoding JSON raises that is not what was written.
DAMAGED = (OSError, AttributeError, KeyError, TypeError, ValueError, OverflowError)
Learning = tuple[frozenset[Pattern], frozenset[str]]  # what makes a problem another one


def _learning(signature: Signature) -> Learning:
    return signature.patterns, signature.context


def rank(explored: Sequence[Explored]) -> list[Candidate]:
    """Candidates, the most promising first."""
    groups: dict[tuple[Learning, Origin], list[Find]] = {}
    for one in explored:
        best: dict[tuple[Learning, Origin], Find] = {}
        for find in one.finds:
            key = (_learning(find.signature), find.origin)
            if key not in best or find.promise > best[key].promise:
                best[key] = find
        for key, find in best.items():
            groups.setdefault(key, []).append(find)
    ranked = [
        Candidate(
            max(finds, key=lambda find: (find.promise, find.signature.name)).signature,
            origin,
            len(finds),
            sum(find.promise / find.plan_steps for find in finds) / len(explored),
        )
        for (_, origin), finds in groups.items()
    ]
    return sorted(ranked, key=lambda c: (-c.promise, c.signature.name, c.origin))


@dataclass
class Training:
    """One training of a library.

    Args:
        place: Whose tasks.
        settings: All hyper-parameters.
        folder: Where everything is kept.
        workers: Where jobs run.
        audience: Who is told.
    """

    place: Place
    settings: TrainingSettings
    folder: Path
    workers: Workers
    audience: Audience
    _shortcuts: list[Shortcut] = field(default_factory=list, init=False)

    def run(self) -> Library:
        """Train.

        Raises:
            InvalidParameterError: The folder has a training with other settings.
        """
        self._claim()
        explored = self._explore()
        ranked = rank(explored)
        self.audience.candidates(ranked)
        operator_steps = mean_steps(explored)
        length = baseline = self._plan_length(())
        tried: set[Learning] = set()
        for candidate in ranked:
            promised = baseline * (1.0 - candidate.promise)
            if _learning(candidate.signature) in tried or not self._shorter(promised, length):
                continue
            if len(tried) == self.settings.shortcuts:
                break
            tried.add(_learning(candidate.signature))
            shortcut = self._try(candidate, operator_steps)
            if shortcut is None:
                continue
            with_it = self._plan_length((*self._shortcuts, shortcut))
            kept = self._shorter(with_it, length)
            self.audience.judged(shortcut.name, length, with_it, kept)
            if kept:
                self._shortcuts.append(shortcut)
                length = with_it
        record = self._record(explored, baseline, length)
        return Library(self.place.domain, tuple(self._shortcuts), record)

    def _shorter(self, steps: float, than: float) -> bool:
        """Whether a plan length is worth the trouble."""
        return steps < than * (1.0 - self.settings.least_saving)

    def _try(self, candidate: Candidate, operator_steps: dict[str, float]) -> Shortcut | None:
        """Learn a candidate; None where no task has a place for it to begin."""
        starts = self._starts(candidate, operator_steps)
        return self._learn(candidate.signature, starts) if starts else None

    # -- the steps --------------------------------------------------------------------------------

    def _explore(self) -> list[Explored]:
        tasks = self.settings.exploration.tasks
        work = [(self.place, i, self.settings.exploration) for i in range(tasks)]
        return self._kept(
            "explored",
            lambda: self._run("exploring tasks", jobs.explore, work),
            lambda data: [Explored.from_json(one) for one in data],
        )

    def _starts(
        self, candidate: Candidate, operator_steps: dict[str, float]
    ) -> tuple[StartRecord, ...]:
        name = candidate.signature.name
        work = [
            (self.place, i, candidate.signature, candidate.origin, operator_steps)
            for i in range(self.settings.starts)
        ]
        return self._kept(
            f"{name}/starts",
            lambda: self._run("collecting starts", jobs.start, work),
            lambda data: tuple(StartRecord.from_json(one) for one in data if one is not None),
        )

    def _learn(self, signature: Signature, starts: tuple[StartRecord, ...]) -> Shortcut:
        folder = self.folder / signature.name
        self.audience.learning(signature.name, folder, self.settings.total_steps)
        processes = self.workers.processes
        work = [(self.place, signature, starts, self.settings, str(folder), processes)]
        ((_, shortcut),) = self.workers.run(jobs.learn, work)
        return shortcut

    def _plan_length(self, shortcuts: tuple[Shortcut, ...]) -> float:
        """Mean on validation tasks; infinite where one was not solved."""
        work = [
            (self.place, i, shortcuts, self.settings.sampling)
            for i in range(self.settings.validation)
        ]
        name = "+".join(["plans", *(shortcut.name for shortcut in shortcuts)])
        return self._kept(
            name,
            lambda: self._run("planning", jobs.plan_length, work),
            lambda lengths: float("inf") if None in lengths else fmean(lengths),
        )

    def _run(self, what: str, function: Any, work: Sequence[tuple[Any, ...]]) -> list[Any]:
        results = []
        self.audience.counting(what, 0, len(work))
        for result in self.workers.run(function, work):
            results.append(result)
            self.audience.counting(what, len(results), len(work))
        return in_order(results)

    # -- what is kept -----------------------------------------------------------------------------

    def _claim(self) -> None:
        """Refuse a folder with another training."""
        mine = json.loads(json.dumps({"place": vars(self.place), **self.settings.as_record()}))
        if self._kept("settings", lambda: mine, lambda kept: kept) != mine:
            raise InvalidParameterError(
                f"{self.folder} has a training with other settings; give another folder, or remove "
                "this one"
            )

    def _kept(
        self, name: str, compute: Callable[[], Any], decode: Callable[[Any], Result]
    ) -> Result:
        """A result from the folder, or computed and put there.

        Raises:
            InvalidParameterError: What is in the folder is damaged.
        """
        path = self.folder / f"{name}.json"
        if not path.exists():
            data = compute()
            path.parent.mkdir(parents=True, exist_ok=True)
            draft = path.with_suffix(".draft")
            draft.write_text(json.dumps(data), encoding="utf-8")
            draft.rename(path)
            return decode(data)
        try:
            return decode(json.loads(path.read_text(encoding="utf-8")))
        except DAMAGED as error:
            raise InvalidParameterError(
                f"{path}: damaged: {error!r}; remove it to have it made anew"
            ) from error

    def _record(
        self, explored: Sequence[Explored], baseline: float, length: float
    ) -> dict[str, Any]:
        steps = [int(shortcut.record.get("environment_steps", 0)) for shortcut in self._shortcuts]
        return {
            "preset": self.place.preset,
            "seed": self.place.seed,
            "validation": {"pure_planning": baseline, "slap": length},
            "environment_steps": {
                "exploring": sum(one.environment_steps for one in explored),
                "learning": sum(steps),
            },
            "settings": self.settings.as_record(),
            "versions": dict(versions()),
        }


def mean_steps(explored: Sequence[Explored]) -> dict[str, float]:
    """Of each operator, over all explored tasks."""
    steps: dict[str, list[float]] = {}
    for one in explored:
        for name, mean in one.operator_steps.items():
            steps.setdefault(name, []).append(mean)
    return {name: fmean(means) for name, means in steps.items()}
