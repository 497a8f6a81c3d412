# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Candidates of several tasks that are the same up to objects: what is worth learning, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from slap_ros.shortcuts.exploration_policies import RANDOM
from slap_ros.shortcuts.exploration_result import ExplorationResult
from slap_ros.shortcuts.shortcut_candidate import OperatorPath, ShortcutCandidate
from slap_ros.shortcuts.signature import Pattern, Signature


@dataclass(frozen=True)
class CandidateGroup:
    """Candidates of several tasks that are the same up to objects: one learning problem.

    Args:
        signature: Signature of the candidate with the largest expected saving.
        operator_path: Names of the operators by which the candidates' sources were reached.
        savings: Share of the plan's length that the candidate is expected to save in each explored
            task; 0 where there was none.
        beyond: Whether a candidate leads to an abstract state that operators alone do not reach.
        found_by: Names of the exploration policies that found candidates.
        replaced: Names of the skills that show it; none where something else found it.
    """

    signature: Signature
    operator_path: OperatorPath
    savings: tuple[float, ...]
    beyond: bool = False
    found_by: tuple[str, ...] = (RANDOM,)
    replaced: OperatorPath = ()

    @property
    def tasks(self) -> int:
        """The number of explored tasks that have a candidate of the group."""
        return sum(saving > 0.0 for saving in self.savings)

    @property
    def relative_saving(self) -> float:
        """The expected saving as a share of a plan's length, mean over all explored tasks."""
        return fmean(self.savings)

    def saving_beside(self, others: Sequence[CandidateGroup]) -> float:
        """The expected saving beyond the best of others in each task, mean over tasks.

        What is in the place of skills that come before or after adds to it instead.

        Args:
            others: Groups that are learned already.
        """
        rivals = [o for o in others if not (self.comes_after(o) or o.comes_after(self))]
        return fmean(
            max(0.0, own - max(best, default=0.0))
            for own, *best in zip(self.savings, *(other.savings for other in rivals), strict=True)
        )

    def comes_after(self, other: CandidateGroup) -> bool:
        """Whether it begins where the skills that show another one have ended, or later.

        Args:
            other: Candidates of another learning problem.
        """
        until = (*other.operator_path, *other.replaced)
        return bool(other.replaced) and self.operator_path[: len(until)] == until


ProblemKey = tuple[frozenset[Pattern], frozenset[str]]  # equal for equal learning problems


def problem_key(signature: Signature) -> ProblemKey:
    """A key that is the same for signatures that a single policy is learned for."""
    return signature.patterns, signature.context


def rank(explored: Sequence[ExplorationResult]) -> list[CandidateGroup]:
    """Group candidates that are the same up to objects; the largest relative saving first."""
    groups: dict[tuple[ProblemKey, OperatorPath], dict[int, ShortcutCandidate]] = {}
    for task, result in enumerate(explored):
        for key, candidate in _best_by_key(result).items():
            groups.setdefault(key, {})[task] = candidate
    ranked = [
        CandidateGroup(
            max(group.values(), key=lambda c: (c.expected_saving, c.signature.name)).signature,
            operator_path,
            tuple(_saving(group.get(task)) for task in range(len(explored))),
            any(candidate.beyond for candidate in group.values()),
            tuple(dict.fromkeys(name for c in group.values() for name in c.found_by)),
            next((c.replaced for c in group.values() if c.replaced), ()),
        )
        for (_, operator_path), group in groups.items()
    ]
    return sorted(ranked, key=lambda g: (-g.relative_saving, g.signature.name, g.operator_path))


def _saving(candidate: ShortcutCandidate | None) -> float:
    """The expected saving of a candidate as a share of the plan's length; 0 without one."""
    return candidate.expected_saving / candidate.plan_steps if candidate is not None else 0.0


def _best_by_key(
    result: ExplorationResult,
) -> dict[tuple[ProblemKey, OperatorPath], ShortcutCandidate]:
    """The candidate that saves most, of one task's candidates that are the same up to objects."""
    best: dict[tuple[ProblemKey, OperatorPath], ShortcutCandidate] = {}
    for candidate in result.candidates:
        key = (problem_key(candidate.signature), candidate.operator_path)
        if key not in best or candidate.expected_saving > best[key].expected_saving:
            best[key] = candidate
    return best


def other_problems(
    groups: Sequence[CandidateGroup], learned: CandidateGroup
) -> list[CandidateGroup]:
    """The groups that another policy is learned for than for one of them."""
    key = problem_key(learned.signature)
    return [other for other in groups if problem_key(other.signature) != key]
