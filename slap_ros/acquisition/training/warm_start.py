# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Warm starts: the known skill whose weights a new one begins with (LG-SAIL Alg. 1 and §4.3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slap_ros.acquisition.training.retrieval import SkillEncoder, nearest
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

    def find(self, operator: LiftedOperator) -> WarmStart | None:
        """The operator's own skill, or else the nearest known one; None where none is near."""
        if operator.name in self.own:
            return WarmStart.of(self.own[operator.name], 1.0)
        keys = {path: self.encoder.encode(skill.operator) for path, skill in self.known.items()}
        found = nearest(self.encoder.encode(operator), keys)
        if found is None or found[1] < self.least_similarity:
            return None
        path, similarity = found
        return WarmStart.of(self.known[path], round(similarity, 3))
