# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC's two critics computed as one, and their gradients without a recorded graph. Needs torch.

With small networks, the bookkeeping of automatic differentiation costs more than what it computes.
The kernels are those that it calls, so that gradients are the same to the bit, as a test shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import torch

Layers = list[tuple[torch.Tensor, torch.Tensor]]  # weights and bias of each layer
Tensors = tuple[torch.Tensor, ...]
LAYER_NORM_EPSILON = 1e-5  # default of torch.nn.functional.layer_norm


class Activation(Protocol):
    """An activation function between two layers."""

    def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, Tensors]:
        """The outputs, and the tensors that :meth:`backward` needs."""

    def backward(self, gradient: torch.Tensor, kept: Tensors) -> torch.Tensor:
        """The gradient by the inputs, from the one by the outputs."""


class Rectifier:
    """The rectifier, max(x, 0)."""

    def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, Tensors]:
        """See :class:`Activation`."""
        outputs = inputs.relu()
        return outputs, (outputs,)

    def backward(self, gradient: torch.Tensor, kept: Tensors) -> torch.Tensor:
        """See :class:`Activation`."""
        (outputs,) = kept
        by_inputs: torch.Tensor = torch.ops.aten.threshold_backward(gradient, outputs, 0)
        return by_inputs


class NormalisedRectifier:
    """Layer normalisation without parameters of its own (Ba et al. 2016), and the rectifier.

    It bounds what a critic makes of actions that no transition has (Ball et al. 2023, §4.2).
    """

    def forward(self, inputs: torch.Tensor) -> tuple[torch.Tensor, Tensors]:
        """See :class:`Activation`."""
        shape = inputs.shape[-1:]
        outputs, *moments = torch.native_layer_norm(inputs, shape, None, None, LAYER_NORM_EPSILON)
        outputs.relu_()
        return outputs, (outputs, inputs, *moments)

    def backward(self, gradient: torch.Tensor, kept: Tensors) -> torch.Tensor:
        """See :class:`Activation`."""
        outputs, inputs, *moments = kept
        by_normalised = torch.ops.aten.threshold_backward(gradient, outputs, 0)
        by_inputs: torch.Tensor
        by_inputs, *_ = torch.ops.aten.native_layer_norm_backward(
            by_normalised, inputs, inputs.shape[-1:], *moments, None, None, [True, False, False]
        )
        return by_inputs


@dataclass(frozen=True)
class ForwardPass:
    """The results of a forward pass through both critics.

    Args:
        values: Values of both critics, shape (2, n, 1).
        inputs: Inputs of each layer, shape (2, n, width).
        kept: Tensors kept by the activation before each layer but the first.
    """

    values: torch.Tensor
    inputs: list[torch.Tensor]
    kept: list[Tensors]


class TwinCritics:
    """Two perceptrons of the same shape as one."""

    activation: Activation = Rectifier()

    def __init__(self, networks: Sequence[torch.nn.Module]) -> None:
        """Make the networks' layers views of one, so that what one changes the other has as well.

        Args:
            networks: Networks of linear layers, with any activation.
        """
        self.layers: Layers = []  # weights (networks, in, out), bias (networks, 1, out)
        for layers in zip(*map(linear_layers, networks), strict=True):
            weights = torch.stack([layer.weight.detach().T for layer in layers])
            bias = torch.stack([layer.bias.detach()[None] for layer in layers])
            for layer, weight, offset in zip(layers, weights, bias, strict=True):
                layer.weight.data, layer.bias.data = weight.T, offset[0]
            self.layers.append((weights, bias))

    @property
    def tensors(self) -> list[torch.Tensor]:
        """The weights and bias of the first layer, then of the next, and so on."""
        return [tensor for layer in self.layers for tensor in layer]

    def __call__(self, observations: torch.Tensor, actions: torch.Tensor) -> ForwardPass:
        """Compute the values of actions.

        Args:
            observations: Observations, shape (n, size).
            actions: Actions, shape (n, axes).
        """
        inputs, kept = [torch.cat([observations, actions], dim=1).expand(2, -1, -1)], []
        (weights, bias), *others = self.layers
        outputs = torch.baddbmm(bias, inputs[0], weights)
        for weights, bias in others:
            hidden, needed = self.activation.forward(outputs)
            outputs = torch.baddbmm(bias, hidden, weights)
            inputs.append(hidden)
            kept.append(needed)
        return ForwardPass(outputs, inputs, kept)

    def weight_gradients(self, forward: ForwardPass, by_values: torch.Tensor) -> list[torch.Tensor]:
        """Compute the gradients by :attr:`tensors`.

        Args:
            forward: Forward pass that gave the values.
            by_values: Gradient by the values, shape (2, n, 1).
        """
        gradients, gradient = [], by_values
        for number in reversed(range(len(self.layers))):
            gradients.append(gradient.sum(dim=1, keepdim=True))
            gradients.append(forward.inputs[number].transpose(1, 2).bmm(gradient))
            if number > 0:
                gradient = self._through(number, forward, gradient)
        return gradients[::-1]

    def action_gradient(
        self, forward: ForwardPass, by_values: torch.Tensor, axes: int
    ) -> torch.Tensor:
        """The gradient by the actions, shape (n, axes).

        Args:
            forward: Forward pass that gave the values.
            by_values: Gradient by the values, shape (2, n, 1).
            axes: Number of axes of an action.
        """
        gradient = by_values
        for number in reversed(range(1, len(self.layers))):
            gradient = self._through(number, forward, gradient)
        weights, _ = self.layers[0]
        return gradient.bmm(weights.transpose(1, 2)).sum(0)[:, -axes:]

    def _through(self, number: int, forward: ForwardPass, by_outputs: torch.Tensor) -> torch.Tensor:
        """The gradient by the outputs of the layer before, from the gradient by a layer's own."""
        weights, _ = self.layers[number]
        by_inputs = by_outputs.bmm(weights.transpose(1, 2))
        return self.activation.backward(by_inputs, forward.kept[number - 1])


def linear_layers(network: torch.nn.Module) -> list[torch.nn.Linear]:
    """The layers of a perceptron that have weights."""
    return [layer for layer in network.modules() if isinstance(layer, torch.nn.Linear)]
