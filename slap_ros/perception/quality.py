# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The quality of perception: noise, dropout, memory and debouncing."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError

MEMORY = 40  # environment steps: longer than an arm stands between a block and a camera


@dataclass(frozen=True)
class Quality:
    """How well is perceived. Noise is normal and new in each step; the default errs in nothing.

    Args:
        position_noise_m: Standard deviation of positions, along each axis.
        turn_noise_rad: Standard deviation of orientations, about each axis.
        threshold_noise: Standard deviation of predicates' thresholds, in the unit of each one's
            metric: m for distances, rad for angles (SLAP D.3).
        dropout: Share of the sightings of an object that are lost.
        hidden: Objects that are never seen (SLAP D.4).
        memory_steps: Environment steps for which an object that is not seen is taken to be where
            it was last; then it is missing.
        debounce: An atom changes once it was perceived as changed so many times in a row.
    """

    position_noise_m: float = 0.0
    turn_noise_rad: float = 0.0
    threshold_noise: float = 0.0
    dropout: float = 0.0
    hidden: frozenset[str] = frozenset()
    memory_steps: int = MEMORY
    debounce: int = 1

    def __post_init__(self) -> None:
        """Check that every value is in its range.

        Raises:
            InvalidParameterError: Says what.
        """
        for name in ("position_noise_m", "turn_noise_rad", "threshold_noise"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InvalidParameterError(f"{name} is a standard deviation, not {value}")
        if not 0.0 <= self.dropout < 1.0:
            raise InvalidParameterError(f"dropout is a share in [0, 1), not {self.dropout}")
        if self.memory_steps < 0:
            raise InvalidParameterError(f"memory is a number of steps, not {self.memory_steps}")
        if self.debounce < 1:
            raise InvalidParameterError(f"debounce is at least 1, not {self.debounce}")

    def require_known(self, names: Collection[str]) -> None:
        """Refuse to hide what is not there.

        Raises:
            InvalidParameterError: An object to be hidden is none of these.
        """
        if unknown := sorted(self.hidden - set(names)):
            raise InvalidParameterError(
                f"{', '.join(unknown)} cannot be hidden; the task has {', '.join(sorted(names))}"
            )

    @property
    def exact_poses(self) -> bool:
        """Whether what is seen is where it is seen."""
        return self.position_noise_m == 0.0 and self.turn_noise_rad == 0.0

    @property
    def exact(self) -> bool:
        """Whether nothing is perceived otherwise than it is."""
        exact = self.exact_poses and self.threshold_noise == 0.0 and self.dropout == 0.0
        return exact and not self.hidden and self.debounce == 1

    @property
    def debounce_delay_steps(self) -> int:
        """Environment steps by which a true atom may be late on account of debouncing."""
        return self.debounce - 1
