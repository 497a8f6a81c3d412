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


def nearest(key: SkillSignature, known: Mapping[str, SkillSignature]) -> tuple[str, float] | None:
    """The name of the nearest of the known keys, and its similarity.

    Args:
        key: Key of the new skill.
        known: Keys of the known skills, by name.

    Returns:
        Name and similarity, the first by name of keys that are equally near; None where no key has
        anything in common.
    """
    best: tuple[str, float] | None = None
    for name in sorted(known):
        similarity = key.similarity(known[name])
        if similarity > 0.0 and (best is None or similarity > best[1] + 1e-12):
            best = name, similarity
    return best
