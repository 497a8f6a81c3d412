# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keys of skills by an embedding model, as the paper has them (LG-SAIL §4.3)."""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256
from typing import Any

from slap_ros.language.text_embedder import TextEmbedder
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.relational import LiftedAtom, LiftedOperator
from slap_ros.skills.skill_signature import SkillSignature


def operator_sentence(operator: LiftedOperator) -> str:
    """⟨PRE, EFF+, EFF-⟩ as text; the operator's name plays no part."""
    parts = (
        ("Preconditions", operator.preconditions),
        ("Add effects", operator.add_effects),
        ("Delete effects", operator.delete_effects),
    )
    return " ".join(f"{name}: {_listed(atoms)}." for name, atoms in parts)


class EmbeddingEncoder:
    """Embeds what operators say.

    It is a :class:`~slap_ros.acquisition.training.retrieval.SkillEncoder`: a vector is a key as
    well, its numbers by their position. Vectors are kept in the work folder, so that a
    training that goes on begins with the same skills, whatever a server says by then.
    """

    def __init__(self, embedder: TextEmbedder, work: WorkFolder) -> None:
        """Prepare an encoder that has embedded nothing yet.

        Args:
            embedder: Model that gives texts their vectors.
            work: Work folder in which vectors are kept.
        """
        self._embedder, self._work = embedder, work

    @property
    def name(self) -> str:
        """The name of the model, and of its server if it has one."""
        return self._embedder.name

    def encode(self, operator: LiftedOperator) -> SkillSignature:
        """The key of an operator.

        Raises:
            LanguageUnavailableError: The server gave no answer.
            LanguageRefusedError: The server does not accept the request: key, model, address.
            InvalidParameterError: A vector that was kept is damaged.
        """
        text = operator_sentence(operator)
        digest = sha256(f"{self.name}\n{text}".encode()).hexdigest()[:16]
        return self._work.cached(
            f"embeddings/{digest}",
            lambda: {"text": text, "vector": self._embedder.embed(text)},
            _signature,
        )


def _signature(data: Any) -> SkillSignature:
    return SkillSignature({str(i): float(number) for i, number in enumerate(data["vector"])})


def _listed(atoms: Iterable[LiftedAtom]) -> str:
    return ", ".join(sorted(map(str, atoms))) or "none"
