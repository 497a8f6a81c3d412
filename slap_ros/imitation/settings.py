# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hyper-parameters of behaviour cloning, in a module of their own that does not import torch."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError


@dataclass(frozen=True)
class CloningSettings:
    """Hyper-parameters of behaviour cloning.

    Args:
        updates: Number of gradient steps.
        batch_size: Number of observations of a gradient step.
        learning_rate: Learning rate in the beginning; it falls to 0 along a cosine.
        weight_decay: Decay of the weights (AdamW).

    Raises:
        InvalidParameterError: A number of updates or a size of batches below 1.
    """

    updates: int = 2_000
    batch_size: int = 128
    learning_rate: float = 1e-3
    weight_decay: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("updates", "batch_size"):
            if getattr(self, name) < 1:
                raise InvalidParameterError(f"{name} is {getattr(self, name)}; give 1 at least")
