# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The retrieval of the known skill that a new one begins with, by its key (LG-SAIL §4.3).

The paper's key is a text embedding of ⟨PRE, EFF+, EFF-⟩, which
:class:`~slap_ros.acquisition.training.embedding_encoder.EmbeddingEncoder` makes. Ours is the metric
signature: the metrics that these atoms rest on, with the direction in which each has to go.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from slap_ros.relational import LiftedOperator
from slap_ros.skills.skill_signature import SkillSignature, signature_of

METRICS = "metrics"
SAME_TO = (
    12  # decimals to which similarities are compared: the last ones depend on the order of sums
)


class SkillEncoder(Protocol):
    """Gives operators their keys."""

    @property
    def name(self) -> str:
        """A name that tells the encoder from others, for work folders and records."""
        ...

    def encode(self, operator: LiftedOperator) -> SkillSignature:
        """The key of an operator."""
        ...


class MetricSignatureEncoder:
    """Keys from metrics alone."""

    name = METRICS

    def encode(self, operator: LiftedOperator) -> SkillSignature:
        """See :class:`SkillEncoder`."""
        return signature_of(operator)


def by_similarity(
    key: SkillSignature, known: Mapping[str, SkillSignature]
) -> list[tuple[str, float]]:
    """The names of known keys that have something in common with a key, the nearest first.

    Args:
        key: Key of the new skill.
        known: Keys of the known skills, by name.

    Returns:
        Names and similarities; of keys that are equally near, the first by name comes first.
    """
    found = [(name, key.similarity(known[name])) for name in sorted(known)]
    near = [(name, similarity) for name, similarity in found if similarity > 0.0]
    return sorted(near, key=lambda pair: -round(pair[1], SAME_TO))


def nearest(key: SkillSignature, known: Mapping[str, SkillSignature]) -> tuple[str, float] | None:
    """The name of the nearest of the known keys, and its similarity.

    Args:
        key: Key of the new skill.
        known: Keys of the known skills, by name.

    Returns:
        Name and similarity, the first by name of keys that are equally near; None where no key has
        anything in common.
    """
    return next(iter(by_similarity(key, known)), None)
