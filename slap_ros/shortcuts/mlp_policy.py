# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Policies as plain numpy: what is learned with torch is run without it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAST_DEVIATION = 0.3  # views are of magnitude 1 or so
# Observations at once. Larger products OpenBLAS spreads over threads, which wait for one another
# where cores are busy, and add up in another order where there are more of them.
MAX_BATCH = 64
Weights = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Normalisation:
    """Makes each observed feature one of mean 0 and deviation 1 or so."""

    mean: Weights  # (size,)
    deviation: Weights  # (size,)
    clip: float = 10.0

    @classmethod
    def of(cls, observations: Weights) -> Normalisation:
        """From observations, shape (n, size).

        What hardly varies at random, like the speed of a tower that is not hit, is not blown up:
        it would drown everything else once it does.
        """
        deviation = np.maximum(observations.std(axis=0), LEAST_DEVIATION)
        return cls(observations.mean(axis=0).astype(np.float32), deviation.astype(np.float32))

    def __call__(self, observations: Weights) -> Weights:
        """Shape (..., size) to the same."""
        normal = (observations - self.mean) / self.deviation
        clipped: Weights = np.clip(normal, -self.clip, self.clip)
        return clipped


@dataclass(frozen=True, eq=False)
class MlpPolicy:
    """A multi-layer perceptron with tanh between its layers, and Gaussian noise on its output.

    Args:
        normalisation: Of observations.
        layers: Weights, shape (out, in), and biases, shape (out,).
        log_std: Of each action, shape (actions,).
    """

    normalisation: Normalisation
    layers: tuple[tuple[Weights, Weights], ...]
    log_std: Weights

    def mean(self, observations: Weights) -> Weights:
        """The most likely actions, shape (n, actions), not yet clipped to [-1, 1]."""
        rows = range(0, max(len(observations), 1), MAX_BATCH)
        return np.concatenate([self._mean(observations[i : i + MAX_BATCH]) for i in rows])

    def _mean(self, observations: Weights) -> Weights:
        hidden = self.normalisation(observations)
        for weights, bias in self.layers[:-1]:
            hidden = np.tanh(hidden @ weights.T + bias)
        weights, bias = self.layers[-1]
        actions: Weights = hidden @ weights.T + bias
        return actions

    def sample(
        self, observations: Weights, rng: np.random.Generator, temperature: float | Weights = 1.0
    ) -> Weights:
        """Actions with noise; temperature, one or of shape (n, 1), 0 is none."""
        mean = self.mean(observations)
        noise = rng.standard_normal(mean.shape, dtype=np.float32)
        actions = mean + temperature * np.exp(self.log_std) * noise
        return actions.astype(np.float32)
