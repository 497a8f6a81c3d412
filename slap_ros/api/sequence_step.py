# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What came of one goal of a sequence, as the record of its library has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class KnownStart:
    """A known skill that another one began with.

    Args:
        skill: Name and digest of the known skill.
        success: Success rate of the known skill before anything was learned.
    """

    skill: str
    success: float


@dataclass(frozen=True)
class SequenceStep:
    """What came of one goal of a sequence.

    Args:
        goal: Name of the goal, or its atoms.
        steps: Environment steps learned for it, all skills together.
        steps_to_level: Environment steps after which ``ENOUGH_IN_A_ROW`` judgements in a row first
            had ``LEVEL`` of the tasks solved; see
            :class:`~slap_ros.acquisition.curriculum.solved_shares.SolvedShares`.
        reached: Whether they ever had; else ``steps_to_level`` are all steps.
        learned: Environment steps of each skill that was learned further, by operator.
        retrieved: Known skill that each of these began with, and its success before, by operator.
        ended: Reason why its acquisition was over, in words.
        tried: Task progress on each goal so far, this one last, by goal.
        solved: Share of the tasks that were solved, for the same goals.
        again: Environment steps of each earlier goal that was learned again after this one.
    """

    goal: str
    steps: int
    steps_to_level: int
    reached: bool
    learned: Mapping[str, int]
    retrieved: Mapping[str, KnownStart]
    ended: str
    tried: Mapping[str, float] = field(default_factory=dict)
    solved: Mapping[str, float] = field(default_factory=dict)
    again: Mapping[str, int] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SequenceStep:
        """The step of :meth:`as_json`.

        Raises:
            LookupError, TypeError, ValueError: The data is no step.
        """
        return cls(
            str(data["goal"]),
            int(data["steps"]),
            int(data["steps_to_level"]),
            bool(data["reached"]),
            _counts(data["learned"]),
            {str(name): KnownStart(**one) for name, one in dict(data["retrieved"]).items()},
            str(data["ended"]),
            _numbers(data["tried"]),
            _numbers(data["solved"]),
            _counts(data.get("again", {})),
        )


def _counts(data: Any) -> dict[str, int]:
    return {str(name): int(steps) for name, steps in dict(data).items()}


def _numbers(data: Any) -> dict[str, float]:
    return {str(goal): float(value) for goal, value in dict(data).items()}
