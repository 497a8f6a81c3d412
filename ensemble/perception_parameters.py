# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of perception_node, which the command line sets as well."""

from __future__ import annotations

from dataclasses import dataclass

from ensemble.parameters import MAX_SEED, parameter
from slap_ros.perception import Quality
from slap_ros.perception.quality import MEMORY


@dataclass(frozen=True)
class PerceptionParameters:
    """How well perception_node perceives: see the docstring of ``perception_node.node``."""

    position_noise: float = parameter(0.0, "m, of positions, along each axis")
    turn_noise: float = parameter(0.0, "rad, of orientations, about each axis")
    threshold_noise: float = parameter(0.0, "m or rad, of predicates' thresholds")
    dropout: float = parameter(0.0, "share of sightings that are lost")
    hidden: str = parameter("", "objects that are never seen, separated by blanks")
    memory: int = parameter(MEMORY, "steps for which what is not seen is where it was")
    debounce: int = parameter(1, "times in a row that an atom is to be perceived as changed")
    noise_seed: int = parameter(0, "noise is a function of it", high=MAX_SEED)

    @property
    def quality(self) -> Quality:
        """The same for the core.

        Raises:
            InvalidParameterError: A value that it cannot have.
        """
        return Quality(
            self.position_noise,
            self.turn_noise,
            self.threshold_noise,
            self.dropout,
            frozenset(self.hidden.split()),
            self.memory,
            self.debounce,
        )
