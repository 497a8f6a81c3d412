# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why there is no plan: what was tried, and what came out differently.

A message names the few failures that say most: of each operator the most frequent one, and of
those the ones after which the fewest atoms differ.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from slap_ros.errors import ErrorCode
from slap_ros.planning.model import Rollout
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import GroundOperator, Target

SHOWN = 2  # failures in a message


@dataclass(frozen=True)
class FailedRollout:
    """An option that did not end in its target when it was rolled out."""

    option: Option
    target: Target
    rollout: Rollout

    @property
    def lifted(self) -> tuple[str, ErrorCode, int]:
        """Failures of one operator that are alike: how it ended, and how many atoms differ."""
        return self.option.skill.name, self.rollout.result.code, self.difference.bit_count()

    @property
    def difference(self) -> int:
        """The atoms that came out differently, a mask; none where the skill did not begin."""
        began = self.rollout.result.code is not ErrorCode.SKILL_NOT_APPLICABLE
        return self.target.difference(self.rollout.abstract) if began else 0

    def __str__(self) -> str:
        """How it failed, in the words of its execution or of its skill."""
        reason = self.rollout.result.reason
        return reason if reason.startswith(str(self.option)) else f"{self.option}: {reason}"


@dataclass
class Failures:
    """The failures of one search."""

    tried: int = 0  # roll-outs, also those that did not fail
    failed: list[FailedRollout] = field(default_factory=list)

    def add(self, option: Option, target: Target, rollout: Rollout) -> None:
        """Take the first attempt of an option from a state.

        Args:
            option: What was tried.
            target: Where it should have ended.
            rollout: What it came to.
        """
        self.tried += 1
        if not rollout.reached:
            self.failed.append(FailedRollout(option, target, rollout))

    def in_words(self) -> str:
        """A sentence about the most telling failures; empty if nothing was tried."""
        if not self.tried:
            return ""
        given = [one for one in self.failed if one.option.kind is OptionKind.OPERATOR]
        shown = _most_telling(given or self.failed)
        what = "; ".join(str(one) for one in shown)
        more = len(self.failed) - len(shown)
        others = f"; and {more} more" if more > 0 else ""
        return f"{len(self.failed)} of {self.tried} options failed in the model: {what}{others}"


def _most_telling(failed: list[FailedRollout]) -> list[FailedRollout]:
    """Of each operator the most frequent failure; the fewest different atoms first."""
    counts = Counter(one.lifted for one in failed)
    best: dict[str, FailedRollout] = {}
    for one in failed:
        name = one.option.skill.name
        if name not in best or counts[one.lifted] > counts[best[name].lifted]:
            best[name] = one
    ranked = sorted(best.values(), key=lambda one: (one.difference.bit_count(), str(one.option)))
    return ranked[:SHOWN]


def unreachable_atoms(start: int, goal: int, operators: Iterable[GroundOperator]) -> int:
    """The atoms of a goal that no sequence of operators makes true, even if none deleted any.

    Args:
        start: The abstract state to start from.
        goal: Mask of atoms that must hold.
        operators: Ground operators over the same atom space.

    Returns:
        A mask; 0 where each can be had, though maybe not all together.
    """
    rest, reached = list(operators), start
    while applicable := [one for one in rest if one.preconditions & ~reached == 0]:
        rest = [one for one in rest if one.preconditions & ~reached]
        for one in applicable:
            reached |= one.add_effects
    return goal & ~reached
