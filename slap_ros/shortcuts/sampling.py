# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The settings by which shortcuts are tried out when planning."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Sampling:
    """Settings of how a shortcut is tried out when planning; ``PAPER`` is what the paper does.

    Args:
        samples: Number of rollouts, the first without noise.
        batch: Number of rollouts in place of each further one, all at once, where a domain's worlds
            can be stepped together.
        alternatives: Number of successful rollouts kept besides the one without noise: each ends in
            another state, and the next option may take less from where a longer one ends.
        refinements: Number of rounds of random variations of the shortest rollout, as in the last
            iterations of a cross-entropy search.
        temperature: Scale of the noise, relative to that of training: risks cost nothing in a
            model.
        horizon: Environment steps of a rollout at most (the paper's T_eval).
        patience: Number of failed rollouts after which, without any success, no more are made.
        spread: Standard deviation of the first refinement, of actions from -1 to 1.
    """

    samples: int = 16
    batch: int = 32
    alternatives: int = 3
    refinements: int = 1
    temperature: float = 2.0
    horizon: int = 40
    patience: int = 16
    spread: float = 0.35


DEFAULT = Sampling()
PAPER = Sampling(samples=1, refinements=0, temperature=1.0, horizon=100)
