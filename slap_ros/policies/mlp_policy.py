# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Policies in numpy: what is learned with torch is executed without it.

A policy is a function on a grid: its inputs and outputs are multiples of
:data:`~slap_ros.portable_math.RESOLUTION`, its sums are exact, and its other functions are
defined to the bit. So a state has the same action on every processor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.policies.activation import ACTIVATIONS, OF_SUMS
from slap_ros.policies.exact_layer import ExactLayer
from slap_ros.portable_math import RESOLUTION, exp, on_grid, tanh_on_grid

LEAST_DEVIATION = 0.3  # features are of magnitude 1 or so
Weights = NDArray[np.float32]
Values = NDArray[np.float64]

# From a step and observations, shape (n, size), to actions, shape (n, actions).
ActionSampler = Callable[[int, Weights], Weights]


class SampledPolicy(Protocol):
    """A policy that can be tried out with noise."""

    def mean(self, observations: Weights) -> Weights:
        """The most likely actions, shape (n, actions), not yet clipped to [-1, 1]."""
        ...

    def sampler(
        self, rng: np.random.Generator, temperature: float | Weights = 1.0
    ) -> ActionSampler:
        """The function that samples actions through one rollout.

        Args:
            rng: Generator that draws the noise.
            temperature: Scale of the noise, a number or of shape (n, 1); 0 for no noise.
        """
        ...


@dataclass(frozen=True, eq=False)
class ObservationNormalisation:
    """Makes each observed feature one of mean 0 and deviation 1 or so."""

    mean: Weights  # mean of each feature, shape (size,)
    deviation: Weights  # standard deviation of each feature, shape (size,)
    clip: float = 10.0

    @classmethod
    def of(cls, observations: Weights) -> ObservationNormalisation:
        """The normalisation of observations, shape (n, size).

        The deviation is never below ``LEAST_DEVIATION``: a feature that hardly varies under random
        actions, like the speed of a tower that is not hit, would outweigh all others once it does.
        """
        deviation = np.maximum(observations.std(axis=0), LEAST_DEVIATION)
        return cls(observations.mean(axis=0).astype(np.float32), deviation.astype(np.float32))

    def __call__(self, observations: Weights) -> Weights:
        """Normalised and clipped observations, shape (..., size) to the same."""
        normal = (observations - self.mean) / self.deviation
        clipped: Weights = np.clip(normal, -self.clip, self.clip)
        return clipped


@dataclass(frozen=True, eq=False)
class MlpPolicy:
    """A multi-layer perceptron, and Gaussian noise on its output.

    Args:
        normalisation: Normalisation of observations.
        layers: Layers of the network: weights, shape (out, in), and biases, shape (out,).
        log_std: Logarithm of the noise's standard deviation for each action, shape (actions,).
        activation: Activation between layers, one of ``ACTIVATIONS``.
        squashed: Whether the most likely actions are kept within (-1, 1) by tanh.
    """

    normalisation: ObservationNormalisation
    layers: tuple[tuple[Weights, Weights], ...]
    log_std: Weights
    activation: str = "tanh"
    squashed: bool = False

    @cached_property
    def _exact_layers(self) -> tuple[ExactLayer, ...]:
        """The layers, each of which can take what the one before it gives."""
        bound, exact = self.normalisation.clip, []
        for weights, bias in self.layers:
            exact.append(ExactLayer.of(weights, bias, bound + RESOLUTION))
            bound = float(ACTIVATIONS[self.activation](np.array(exact[-1].bound)))
        return tuple(exact)

    def mean(self, observations: Weights) -> Weights:
        """The most likely actions, shape (n, actions), not yet clipped to [-1, 1]."""
        *hidden, last = self._exact_layers
        values = on_grid(self.normalisation(observations).astype(np.float64))
        for layer in hidden:
            values = OF_SUMS[self.activation](layer.sums(values), layer.bias)
        actions = last(values)
        rounded = tanh_on_grid(actions) if self.squashed else on_grid(actions)
        return rounded.astype(np.float32)

    def sample(
        self, observations: Weights, rng: np.random.Generator, temperature: float | Weights = 1.0
    ) -> Weights:
        """Actions with Gaussian noise.

        Args:
            observations: Observations, shape (n, size).
            rng: Generator that draws the noise.
            temperature: Scale of the noise, a number or of shape (n, 1); 0 for no noise.

        Returns:
            Shape (n, actions), not yet clipped to [-1, 1].
        """
        mean = self.mean(observations)
        noise = rng.standard_normal(mean.shape, dtype=np.float32)
        actions = mean + temperature * self._deviation * noise
        return on_grid(actions.astype(np.float32))

    @cached_property
    def _deviation(self) -> Weights:
        """Standard deviation of the noise on each action, shape (actions,)."""
        return exp(self.log_std.astype(np.float64)).astype(np.float32)

    def sampler(
        self, rng: np.random.Generator, temperature: float | Weights = 1.0
    ) -> ActionSampler:
        """See :class:`SampledPolicy`; steps are independent."""
        return lambda _, observations: self.sample(observations, rng, temperature)
