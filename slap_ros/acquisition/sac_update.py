# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic (Haarnoja et al. 2018) of stable-baselines3, with an update that costs less.

The losses, the networks, the optimisers and the order of random draws are the library's, so that
the weights after an update are the same up to rounding, which a test shows. What is left out is
what small networks spend their time on: gradients of the critics for the actor's loss, which are
thrown away; objects for distributions; hooks of modules; a loop over the parameters of the target
networks; and figures for a logger.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from stable_baselines3 import SAC
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch.nn import functional

LOG_SQRT_TAU = 0.5 * math.log(2.0 * math.pi)
SQUASH_EPSILON = 1e-6  # against log 0, as the library has it


Layers = list[tuple[torch.Tensor, torch.Tensor]]  # weights and bias of each


def _layers(network: torch.nn.Module) -> Layers:
    """The linear layers of a perceptron; between them is the rectifier."""
    return [
        (layer.weight, layer.bias)
        for layer in network.modules()
        if isinstance(layer, torch.nn.Linear)
    ]


def _forward(layers: Layers, inputs: torch.Tensor) -> torch.Tensor:
    """What a perceptron makes of its inputs, without a module's hooks."""
    (weight, bias), *others = layers
    outputs = functional.linear(inputs, weight, bias)
    for weight, bias in others:
        outputs = functional.linear(outputs.relu(), weight, bias)
    return outputs


class LeanSac(SAC):
    """SAC without batch normalisation and state-dependent exploration."""

    def _setup_model(self) -> None:
        super()._setup_model()
        assert self.log_ent_coef is not None
        rate = self.lr_schedule(1.0)
        self.ent_coef_optimizer = torch.optim.Adam([self.log_ent_coef], lr=rate, fused=True)
        self._online = [_layers(network) for network in self.critic.q_networks]
        self._target = [_layers(network) for network in self.critic_target.q_networks]
        self._hidden = _layers(self.actor.latent_pi)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Update the networks so many times, each with a batch of its own.

        Args:
            gradient_steps: Updates.
            batch_size: Transitions of each.
        """
        online: list[torch.Tensor] = list(self.critic.parameters())
        target: list[torch.Tensor] = list(self.critic_target.parameters())
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)  # type: ignore[union-attr]
            actions, log_prob = self._act(batch.observations)
            entropy_weight = self._update_entropy_weight(log_prob)
            self._update_critic(batch, entropy_weight)
            self._update_actor(batch.observations, actions, log_prob, entropy_weight)
            with torch.no_grad():
                torch._foreach_lerp_(target, online, self.tau)
        self._n_updates += gradient_steps

    def _act(self, observations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Actions drawn from the policy, and the logarithm of their density, shape (n, 1)."""
        hidden = _forward(self._hidden, observations).relu()
        mean, log_std = self.actor.mu(hidden), self.actor.log_std(hidden)  # type: ignore[operator]
        log_std = log_std.clamp(LOG_STD_MIN, LOG_STD_MAX)
        noise = torch.randn_like(mean)
        actions = torch.tanh(mean + log_std.exp() * noise)
        gaussian = -0.5 * noise * noise - log_std - LOG_SQRT_TAU
        squash = torch.log(1.0 - actions * actions + SQUASH_EPSILON)
        return actions, (gaussian - squash).sum(dim=1, keepdim=True)

    @staticmethod
    def _least_value(
        critics: list[Layers], observations: torch.Tensor, actions: torch.Tensor
    ) -> torch.Tensor:
        """The least of both critics' values, shape (n, 1)."""
        inputs = torch.cat([observations, actions], dim=1)
        one, other = (_forward(network, inputs) for network in critics)
        return torch.minimum(one, other)

    def _update_entropy_weight(self, log_prob: torch.Tensor) -> torch.Tensor:
        """Move the entropy's weight towards the target entropy; the weight before that."""
        assert self.log_ent_coef is not None
        assert self.ent_coef_optimizer is not None
        weight = self.log_ent_coef.detach().exp()
        loss = -(self.log_ent_coef * (log_prob + float(self.target_entropy)).detach()).mean()
        self.ent_coef_optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.ent_coef_optimizer.step()
        return weight

    def _update_critic(self, batch: Any, entropy_weight: torch.Tensor) -> None:
        with torch.no_grad():
            actions, log_prob = self._act(batch.next_observations)
            value = self._least_value(self._target, batch.next_observations, actions)
            value -= entropy_weight * log_prob
            wanted = batch.rewards + (1.0 - batch.dones) * self.gamma * value
        inputs = torch.cat([batch.observations, batch.actions], dim=1)
        one, other = (_forward(network, inputs) for network in self._online)
        loss = 0.5 * (functional.mse_loss(one, wanted) + functional.mse_loss(other, wanted))
        self.critic.optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.critic.optimizer.step()

    def _update_actor(
        self,
        observations: torch.Tensor,
        actions: torch.Tensor,
        log_prob: torch.Tensor,
        entropy_weight: torch.Tensor,
    ) -> None:
        """Towards actions of more value and entropy.

        Args:
            observations: Shape (n, size).
            actions: Drawn from the policy in each, with its gradient, shape (n, axes).
            log_prob: Logarithm of their density, with its gradient, shape (n, 1).
            entropy_weight: What entropy is worth.
        """
        self.critic.requires_grad_(False)  # only its value's gradient by the actions is used
        value = self._least_value(self._online, observations, actions)
        loss = (entropy_weight * log_prob - value).mean()
        self.critic.requires_grad_(True)
        self.actor.optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.actor.optimizer.step()
