# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The distribution of tasks that a training draws from."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.core import Domain
from slap_ros.domains import get_domain

TRAINING_SEED = 1_000_000  # added to the seed: training never sees the tasks of evaluation


@dataclass(frozen=True)
class TaskDistribution:
    """The tasks of a domain, a preset and a seed."""

    domain: str
    preset: str
    seed: int

    @property
    def task_seed(self) -> int:
        """The seed of training tasks, which evaluation never uses."""
        return TRAINING_SEED + self.seed

    def make_domain(self) -> Domain:
        """The domain with its preset."""
        return get_domain(self.domain, self.preset)
