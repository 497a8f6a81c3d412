# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A policy is the network that was trained, and the same function whatever sums it up how."""

from itertools import pairwise

import numpy as np
import pytest

from slap_ros.policies.activation import tanh_of_sums
from slap_ros.policies.exact_layer import ExactLayer
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.portable_math import on_grid

SIZES = (30, 256, 256, 7)


def network(activation: str, squashed: bool) -> MlpPolicy:
    rng = np.random.default_rng(1)
    layers = tuple(
        (
            rng.normal(0.0, 1.5 / inputs**0.5, (outputs, inputs)).astype(np.float32),
            rng.normal(size=outputs).astype(np.float32),
        )
        for inputs, outputs in pairwise(SIZES)
    )
    mean, one = np.full(30, 0.1, dtype=np.float32), np.ones(30, dtype=np.float32)
    return MlpPolicy(
        ObservationNormalisation(mean, one), layers, np.zeros(7, np.float32), activation, squashed
    )


def in_floating_point(policy: MlpPolicy, observations: np.ndarray) -> np.ndarray:
    values = np.clip(observations - 0.1, -10.0, 10.0).astype(np.float64)
    for i, (weights, bias) in enumerate(policy.layers):
        values = values @ weights.T.astype(np.float64) + bias
        if i < len(policy.layers) - 1:
            values = np.tanh(values) if policy.activation == "tanh" else np.maximum(values, 0.0)
    return np.tanh(values) if policy.squashed else values


@pytest.mark.parametrize(("activation", "squashed"), [("tanh", False), ("relu", True)])
def test_a_policy_acts_as_the_network_that_was_trained(activation, squashed):
    policy = network(activation, squashed)
    observations = np.random.default_rng(2).normal(0.0, 3.0, (100, 30)).astype(np.float32)
    expected = in_floating_point(policy, observations)
    np.testing.assert_allclose(policy.mean(observations), expected, atol=5e-4)


def test_actions_are_on_the_grid():
    policy, observations = network("tanh", False), np.zeros((5, 30), dtype=np.float32)
    for actions in (
        policy.mean(observations),
        policy.sample(observations, np.random.default_rng(3)),
    ):
        np.testing.assert_array_equal(actions, on_grid(actions))


def test_rows_do_not_depend_on_the_rows_beside_them():
    policy = network("tanh", False)
    observations = np.random.default_rng(4).normal(size=(70, 30)).astype(np.float32)
    alone = np.concatenate([policy.mean(row[None]) for row in observations])
    assert alone.tobytes() == policy.mean(observations).tobytes()


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_the_sums_of_a_layer_are_exact_in_any_order(scale):
    rng = np.random.default_rng(5)
    weights = rng.normal(0.0, scale, (20, 300)).astype(np.float32)
    layer = ExactLayer.of(weights, np.zeros(20, dtype=np.float32), input_bound=10.0)
    inputs = np.clip(on_grid(rng.normal(0.0, 4.0, (8, 300))), -10.0, 10.0)
    for part in layer.parts:
        one_by_one = np.zeros((8, 20))
        for i in rng.permutation(300):
            one_by_one += inputs[:, i : i + 1] * part[i]
        assert one_by_one.tobytes() == (inputs @ part).tobytes()
    np.testing.assert_allclose(layer(inputs), inputs @ weights.T.astype(float), atol=1e-10 * scale)


def test_compiled_activation_has_the_bits_of_numpy():
    kernels = pytest.importorskip("slap_ros.policies.kernels")
    rng = np.random.default_rng(5)
    bias = rng.normal(size=40)
    sums = rng.normal(0.0, 10.0 ** rng.uniform(-8.0, 2.0, (200, 1)), (200, 80))
    sums[0], bias[0] = 0.0, -0.0
    sums[1, :40] = on_grid(sums[1, :40])
    sums[2] = np.nan
    found, expected = kernels.tanh_of_sums(sums, bias), tanh_of_sums(sums, bias)
    assert found.tobytes() == expected.tobytes()
