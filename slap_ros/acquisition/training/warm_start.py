# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Warm starts: the known skill whose weights a new one begins with (LG-SAIL Alg. 1 and §4.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from slap_ros.acquisition.training.retrieval import SkillEncoder, by_similarity
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.relational import LiftedOperator
from slap_ros.skills.skill_library import AcquiredSkill


@dataclass(frozen=True)
class WarmStart:
    """The start of a new skill with the weights of a known one.

    Args:
        skill: Name and digest of the known skill.
        similarity: Similarity of the known skill's operator to the new one's; 1 for the same
            operator.
        policy: Policy of the known skill, with its weights.
    """

    skill: str
    similarity: float
    policy: MlpPolicy

    @classmethod
    def of(cls, skill: AcquiredSkill, similarity: float) -> WarmStart:
        """The warm start that a known skill gives."""
        return cls(skill.folder_name, similarity, skill.policy)

    def as_json(self) -> dict[str, Any]:
        """A JSON object without the weights, for the record of the new skill."""
        return {"skill": self.skill, "similarity": self.similarity}


@dataclass(frozen=True)
class WarmStarts:
    """Known skills, by what they do.

    Args:
        own: Skills that are there already, by the names of their operators.
        known: Skills of other libraries, by the paths of their folders.
        encoder: Encoder that gives operators the keys by which known skills are found.
        least_similarity: Least similarity of a known skill that is worth beginning with.
    """

    own: Mapping[str, AcquiredSkill]
    known: Mapping[str, AcquiredSkill]
    encoder: SkillEncoder
    least_similarity: float

    def find_own(self, operator: LiftedOperator) -> WarmStart | None:
        """The operator's own skill, which needs no trial; None where there is none."""
        own = self.own.get(operator.name)
        return None if own is None else WarmStart.of(own, 1.0)

    def find_near(self, operator: LiftedOperator, most: int) -> list[WarmStart]:
        """The known skills that are near enough, the nearest first.

        Args:
            operator: Operator of the new skill.
            most: Largest number of known skills.
        """
        keys = {path: self.encoder.encode(skill.operator) for path, skill in self.known.items()}
        return [
            WarmStart.of(self.known[path], round(similarity, 3))
            for path, similarity in by_similarity(self.encoder.encode(operator), keys)[:most]
            if similarity >= self.least_similarity
        ]


@dataclass(frozen=True)
class TriedStart:
    """A warm start, and how it did before anything was learned.

    Args:
        start: Warm start that was tried.
        success: Success rate of the known skill in place of the new one.
    """

    start: WarmStart
    success: float

    def as_json(self) -> dict[str, Any]:
        """A JSON object without the weights, for the record of the new skill."""
        return {**self.start.as_json(), "success": self.success}


@dataclass(frozen=True)
class ChosenStart:
    """How a new skill begins, and what it might have begun with.

    Args:
        start: Warm start; None for random weights.
        tried: Warm starts that were tried, the nearest first.
    """

    start: WarmStart | None = None
    tried: tuple[TriedStart, ...] = ()

    @classmethod
    def among(cls, tried: Sequence[TriedStart], least_success: float) -> ChosenStart:
        """The warm start that did best; of equally good ones the nearest.

        Args:
            tried: Warm starts that were tried, the nearest first; one at least.
            least_success: Least success rate of a known skill that is worth beginning with. Where
                none has it, the skill is learned from scratch.
        """
        best = max(tried, key=lambda one: one.success)
        return cls(best.start if best.success >= least_success else None, tuple(tried))
