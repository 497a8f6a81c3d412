# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How skills were acquired: iterations, the success of each skill, and shortcuts over them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import isfinite
from statistics import fmean
from typing import NamedTuple, cast

from slap_ros.messages.events import AcquisitionEventKind
from slap_ros.messages.protocols import (
    AcquisitionEventMessage,
    LearningEventMessage,
    ShortcutEventMessage,
)

SKILLS = "skills"  # subject of what ends an acquisition
LEARNING = frozenset({AcquisitionEventKind.ROLLED_OUT, AcquisitionEventKind.JUDGED})
ENDS = {
    AcquisitionEventKind.ACQUIRED: "skills acquired",
    AcquisitionEventKind.FAILED: "failed",
    AcquisitionEventKind.CANCELED: "canceled",
}


class FailureCount(NamedTuple):
    """How often an operator failed, and the commonest reason."""

    operator: str
    times: int
    reason: str


@dataclass(frozen=True)
class RecordedIteration:
    """Plans that were carried out with the skills at hand.

    Args:
        number: Number of the iteration, from 0.
        progress: Mean share of a plan that was done, 0 to 1.
        rollouts: Plans that were carried out.
        failures: Operators that failed.
    """

    number: int
    progress: float
    rollouts: int
    failures: tuple[FailureCount, ...]


@dataclass(frozen=True)
class SkillCurve:
    """The success of a skill over the steps that it learned for.

    Args:
        skill: Name of the operator.
        steps: Environment steps, from 0.
        success: Share of fresh starts, 0 to 1, after so many steps.
    """

    skill: str
    steps: tuple[int, ...]
    success: tuple[float, ...]

    @property
    def best(self) -> float:
        """The success of the checkpoint that stays."""
        return max(self.success)

    @property
    def points(self) -> str:
        """The curve in a box of width 1 and height 1, as SVG has it."""
        last = self.steps[-1] or 1
        pairs = zip(self.steps, self.success, strict=True)
        return " ".join(f"{step / last:.4f},{1.0 - share:.3f}" for step, share in pairs)


@dataclass(frozen=True)
class RecordedShortcut:
    """A shortcut that was learned over the skills, and tried on validation tasks.

    Args:
        name: Name of the shortcut.
        without: Environment steps of the mean plan without the shortcut; None if not known.
        length: Environment steps of the mean plan with it; None where a task had no plan then.
        kept: Whether the shortcut became part of its library.
    """

    name: str
    without: float | None
    length: float | None
    kept: bool


@dataclass(frozen=True)
class RecordedAcquisition:
    """Skills that were acquired, as far as the bag tells.

    Args:
        outcome: Outcome of the acquisition in a word or two.
        reason: Reason of a failure; empty if it did not fail.
        digest: Digest of the library; empty if there is none.
        operators: Operators with their rewards, as people read them.
        iterations: Iterations in order.
        curves: Learning curves, one per skill that was trained.
        shortcuts: Shortcuts that were learned over the skills, in order.
    """

    outcome: str
    reason: str
    digest: str
    operators: tuple[str, ...]
    iterations: tuple[RecordedIteration, ...]
    curves: tuple[SkillCurve, ...]
    shortcuts: tuple[RecordedShortcut, ...] = ()


@dataclass
class _OngoingAcquisition:
    """What is known of one so far."""

    operators: Sequence[str] = ()
    events: list[LearningEventMessage] = field(default_factory=list)
    shortcuts: list[RecordedShortcut] = field(default_factory=list)

    @property
    def is_known(self) -> bool:
        """Whether there is anything to show of it."""
        return bool(self.events or self.shortcuts)

    def ended(self, outcome: str, reason: str = "", digest: str = "") -> RecordedAcquisition:
        rolled_out = [e for e in self.events if e.kind == AcquisitionEventKind.ROLLED_OUT]
        judged = [e for e in self.events if e.kind == AcquisitionEventKind.JUDGED]
        iterations = sorted({event.iteration for event in rolled_out})
        skills = dict.fromkeys(event.subject for event in judged)
        curves = (_curve(name, [e for e in judged if e.subject == name]) for name in skills)
        return RecordedAcquisition(
            outcome,
            reason,
            digest,
            tuple(map(str, self.operators)),
            tuple(_iteration(n, [e for e in rolled_out if e.iteration == n]) for n in iterations),
            tuple(curve for curve in curves if curve.steps),
            tuple(self.shortcuts),
        )


def recorded_acquisitions(
    events: Iterable[AcquisitionEventMessage],
) -> tuple[RecordedAcquisition, ...]:
    """The acquisitions of skills that a bag's events tell of, in order."""
    found: list[RecordedAcquisition] = []
    now = _OngoingAcquisition()
    for event in events:
        if event.kind == AcquisitionEventKind.STARTED:
            if now.is_known:
                found.append(now.ended("not ended"))
            now = _OngoingAcquisition()
        elif event.kind == AcquisitionEventKind.FINISHED:
            now.operators = getattr(event, "operators", ())  # earlier bags have none
        elif event.kind in LEARNING:
            now.events.append(cast(LearningEventMessage, event))
        elif event.kind == AcquisitionEventKind.VALIDATED:
            now.shortcuts.append(_shortcut(cast(ShortcutEventMessage, event)))
        elif event.kind in ENDS and now.is_known:
            digest = getattr(event, "digest", "")
            kind = AcquisitionEventKind(event.kind)
            found.append(now.ended(ENDS[kind], event.error_msg, digest))
            now = _OngoingAcquisition()
    if now.is_known:
        found.append(now.ended("not ended"))
    return tuple(found)


def _shortcut(event: ShortcutEventMessage) -> RecordedShortcut:
    known = [float(length) if isfinite(length) else None for length in event.lengths]
    without, length, *_ = [*known, None, None]
    return RecordedShortcut(event.subject, without, length, bool(event.kept))


def _iteration(number: int, rollouts: Sequence[LearningEventMessage]) -> RecordedIteration:
    failed = Counter(event.subject for event in rollouts if event.subject)
    failures = []
    for operator, count in failed.most_common():
        reasons = Counter(_reason(e) for e in rollouts if e.subject == operator)
        failures.append(FailureCount(operator, count, reasons.most_common(1)[0][0]))
    progress = fmean(_share(event.progress) for event in rollouts)
    return RecordedIteration(number, progress, len(rollouts), tuple(failures))


def _reason(event: LearningEventMessage) -> str:
    first, *atoms = [*map(str, event.complaints), ""]
    atoms = [atom for atom in atoms if atom]
    return f"{first}: {', '.join(atoms)}" if atoms else first


def _curve(skill: str, rounds: Sequence[LearningEventMessage]) -> SkillCurve:
    """All rounds one after the other; each begins with a judgement of what it begins with."""
    steps: list[int] = []
    success: list[float] = []
    done = 0
    for event in rounds:
        for i, share in enumerate(event.success):
            done += event.segment_steps if i else 0
            steps.append(done)
            success.append(_share(share))
    return SkillCurve(skill, tuple(steps), tuple(success))


def _share(value: float) -> float:
    """A share as it can be drawn, whatever a bag has."""
    return min(max(float(value), 0.0), 1.0) if isfinite(value) else 0.0
