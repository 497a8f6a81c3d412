# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The distribution of tasks that a training draws from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from slap_ros.core import Domain
from slap_ros.skills.domain_choice import DomainChoice

TRAINING_SEED = 1_000_000  # number added to the seed: training never sees the tasks of evaluation


@dataclass(frozen=True)
class TaskDistribution:
    """The tasks of a domain and a seed."""

    domain: DomainChoice
    seed: int

    @property
    def task_seed(self) -> int:
        """The seed of training tasks, which evaluation never uses."""
        return TRAINING_SEED + self.seed

    def make_domain(self) -> Domain:
        """The domain, in this process."""
        return self.domain.make()

    def as_json(self) -> dict[str, Any]:
        """A JSON object: what tells the domain from others, and the seed."""
        return {**self.domain.identity, "seed": self.seed}
