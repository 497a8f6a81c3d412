# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exporting torch's networks to policies that run without torch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import torch

Layers = tuple[tuple[NDArray[np.float32], NDArray[np.float32]], ...]


def weights_of(network: torch.nn.Module) -> dict[str, NDArray[np.float32]]:
    """Copies of a network's arrays, by name."""
    return {name: value.cpu().numpy().copy() for name, value in network.state_dict().items()}


def hidden_layers(prefix: str, count: int) -> list[str]:
    """Names of the linear layers of a network that has an activation after each of them."""
    return [f"{prefix}.{2 * i}" for i in range(count)]


def exported_layers(weights: Mapping[str, NDArray[np.float32]], names: Sequence[str]) -> Layers:
    """The weight and the bias of each layer.

    Args:
        weights: Arrays by their names in torch, ``LAYER.weight`` and ``LAYER.bias``.
        names: Names of the layers, the output layer last.
    """
    return tuple((weights[f"{name}.weight"], weights[f"{name}.bias"]) for name in names)
