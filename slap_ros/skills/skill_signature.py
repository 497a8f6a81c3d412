# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The key of a skill in a library: the metrics that its operator changes.

Names of operators, predicates and objects play no part, metrics do: opening a drawer and opening a
cabinet move the same one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from slap_ros.relational import LiftedAtom, LiftedOperator
from slap_ros.relational.metrics import Condition

PARTS = {"EFF+": 1.0, "EFF-": 0.5, "PRE": 0.25}  # weights: what a skill brings about counts most


@dataclass(frozen=True)
class SkillSignature:
    """A sparse vector that says what a skill does: weights by name."""

    weights: Mapping[str, float]

    def similarity(self, other: SkillSignature) -> float:
        """The cosine of the angle to another: 1 for the same, 0 for nothing in common."""
        both = sum(weight * other.weights.get(name, 0.0) for name, weight in self.weights.items())
        norms = self._norm() * other._norm()
        return both / norms if norms else 0.0

    def _norm(self) -> float:
        return math.sqrt(sum(weight * weight for weight in self.weights.values()))

    def as_json(self) -> dict[str, float]:
        """A JSON object, in alphabetic order."""
        return dict(sorted(self.weights.items()))

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> SkillSignature:
        """The signature of :meth:`as_json`.

        Raises:
            AttributeError, TypeError, ValueError: The data is no signature.
        """
        return cls({str(name): float(weight) for name, weight in data.items()})


def signature_of(operator: LiftedOperator) -> SkillSignature:
    """The metric signature of an operator."""
    weights: dict[str, float] = {}
    for part, atoms in (
        ("EFF+", operator.add_effects),
        ("EFF-", operator.delete_effects),
        ("PRE", operator.preconditions),
    ):
        for name in _directions(atoms):
            weights[f"{part} {name}"] = weights.get(f"{part} {name}", 0.0) + PARTS[part]
    return SkillSignature(weights)


def _directions(atoms: Iterable[LiftedAtom]) -> list[str]:
    """The metrics behind atoms, and where each has to go; without metrics the predicate's name."""
    names = []
    for atom in sorted(atoms, key=str):
        conditions = atom.predicate.conditions
        names += [_direction(condition) for condition in conditions] or [atom.predicate.name]
    return names


def _direction(condition: Condition) -> str:
    if math.isinf(condition.lower):
        return f"{condition.metric.name} down"
    if math.isinf(condition.upper):
        return f"{condition.metric.name} up"
    return f"{condition.metric.name} within"
