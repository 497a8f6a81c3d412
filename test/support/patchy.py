# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sweeping domain, in which some pucks lie where the broom never gets."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slap_ros.core import Domain, Learning, Task, presets
from slap_ros.domains.variation import varied
from support import sweeping


@dataclass(frozen=True)
class Tasks:
    """Tasks of which a share has no plan."""

    out_of_reach: float = 0.5

    def sample(self, rng: np.random.Generator) -> Task:
        """A task."""
        task = sweeping.sample_task(rng)
        if rng.uniform() >= self.out_of_reach:
            return task
        puck = task.initial_state.layout.object("puck0")
        return replace(task, initial_state=task.initial_state.replace({(puck, "y"): -1.0}))


@presets("some", "none")
def make(preset: str, changes: Mapping[str, str]) -> Domain:
    """The domain: preset ``some`` has tasks with a plan, ``none`` has not."""
    tasks = varied(Tasks(0.5 if preset == "some" else 1.0), changes)
    return replace(
        sweeping.make(),
        name="patchy",
        preset=preset,
        sample_task=tasks.sample,
        learning=Learning(
            sweeping.LEARNER_INTERFACE,
            settings={
                "ours": {"exploration.rollouts": 32, "polish": None, "shortcuts": 0},
                "quick": {"ppo.total_steps": 1000, "ppo.net_arch": (8,)},
            },
        ),
    )
