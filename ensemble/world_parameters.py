# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of every node in the world's place."""

from __future__ import annotations

from dataclasses import dataclass

from ensemble.common_parameters import LIBRARIES
from ensemble.parameters import MAX_SEED, parameter
from slap_ros.core import Domain, Task, task_with_goal
from slap_ros.skills.domain_choice import DomainChoice


@dataclass(frozen=True)
class WorldParameters:
    """Which domain runs, and its first task."""

    domain: str = parameter("obstacle2d", "which domain")
    preset: str = parameter("", "the domain's; empty: its first, which of ours is fair")
    seed: int = parameter(0, "samples the first task", high=MAX_SEED)
    skills: str = parameter("", "none, demonstrator, or a library's folder; empty: what ships")
    index: int = parameter(0, "which of the seed's tasks")
    libraries: str = parameter(
        LIBRARIES, "folders below which a library that is announced may lie, separated by ':'"
    )
    goal: str = parameter("", "of the first task: by name, or as atoms; empty: its own")

    @property
    def choice(self) -> DomainChoice:
        """The domain that runs.

        Raises:
            InvalidParameterError: Skills that are not known.
        """
        return DomainChoice(self.domain, self.preset, self.skills)

    def first_task(self, domain: Domain) -> Task:
        """The first task; where the goal has a name, one that has the goal's objects.

        Raises:
            SlapError: The goal cannot be had in this task.
        """
        return task_with_goal(domain, self.seed, self.index, self.goal)
