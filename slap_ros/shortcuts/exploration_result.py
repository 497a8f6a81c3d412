# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The outcome of exploring one task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from slap_ros.learning.stored_keys import restored, stored
from slap_ros.shortcuts.shortcut_candidate import ShortcutCandidate


@dataclass(frozen=True)
class ExplorationResult:
    """The outcome of exploring one task.

    Args:
        candidates: Candidates that were not pruned and are expected to shorten the plan.
        pairs: Number of pairs of abstract states that no option joins: the paper's candidates.
        environment_steps: Environment steps simulated while exploring.
        operator_steps: Mean environment steps of each operator, by name.
    """

    candidates: tuple[ShortcutCandidate, ...]
    pairs: int
    environment_steps: int
    operator_steps: Mapping[str, float]

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`."""
        return stored(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ExplorationResult:
        """The result of :meth:`as_json`.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: The data is no result.
        """
        values = restored(cls, data)
        return cls(
            tuple(ShortcutCandidate.from_json(candidate) for candidate in values["candidates"]),
            int(values["pairs"]),
            int(values["environment_steps"]),
            {str(name): float(mean) for name, mean in values["operator_steps"].items()},
        )


def mean_operator_steps(explored: Sequence[ExplorationResult]) -> dict[str, float]:
    """Mean environment steps of each operator over all explored tasks, by name."""
    steps: dict[str, list[float]] = {}
    for result in explored:
        for name, mean in result.operator_steps.items():
            steps.setdefault(name, []).append(mean)
    return {name: fmean(means) for name, means in steps.items()}
