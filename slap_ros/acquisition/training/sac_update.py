# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic (Haarnoja et al. 2018) of stable-baselines3, with an update that costs less.

The losses, the networks, the optimisers and the order of random draws are the library's, so that
the weights after an update are the same up to rounding, which a test shows. What is left out is
what small networks spend their time on: a recorded graph of the critics; their weights' gradients
for the actor's loss, which are thrown away; objects for distributions; hooks of modules; a loop
over the parameters of the target networks; and figures for a logger.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from stable_baselines3 import SAC
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch.nn import functional

from slap_ros.acquisition.training.twin_critics import (
    NormalisedRectifier,
    TwinCritics,
    linear_layers,
)

LOG_SQRT_TAU = 0.5 * math.log(2.0 * math.pi)
SQUASH_EPSILON = 1e-6  # term that avoids log 0, as in stable-baselines3


class LeanSac(SAC):
    """SAC without batch normalisation and state-dependent exploration.

    Beside the actor there is its average over updates, which follows as target networks do. From
    one update to the next the actor goes to and fro between good and bad; its average does not.
    """

    averaged: dict[str, torch.Tensor]  # the actor's average, by name
    core_to_spare: Callable[[], bool]  # whether the critics may use a second core just now

    def _setup_model(self) -> None:
        super()._setup_model()
        assert self.log_ent_coef is not None
        rate = self.lr_schedule(1.0)
        self.ent_coef_optimizer = torch.optim.Adam([self.log_ent_coef], lr=rate, fused=True)
        self._online = TwinCritics(self.critic.q_networks)
        self._target = TwinCritics(self.critic_target.q_networks)
        make: Callable[..., torch.optim.Optimizer] = self.policy.optimizer_class
        settings = self.policy.optimizer_kwargs
        self.critic.optimizer = make(self._online.tensors, lr=rate, **settings)
        self._actor_weights = list(self.actor.parameters())
        self._hidden = [(layer.weight, layer.bias) for layer in linear_layers(self.actor.latent_pi)]
        self.core_to_spare = lambda: False
        self.averaged = {k: v.detach().clone() for k, v in self.actor.state_dict().items()}

    def normalise_critics(self) -> None:
        """Normalise the hidden layers of the critics from now on."""
        self._online.activation = self._target.activation = NormalisedRectifier()

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Update the networks so many times, each with a batch of its own.

        Args:
            gradient_steps: Number of updates.
            batch_size: Number of transitions of each update.
        """
        online = [*self._online.tensors, *self._actor_weights]
        following = [*self._target.tensors, *self.averaged.values()]
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)  # type: ignore[union-attr]
            actions, log_prob = self._act(batch.observations)
            ent_coef = self._update_ent_coef(log_prob)
            self._update_critic(batch, ent_coef)
            self._update_actor(batch.observations, actions, log_prob, ent_coef)
            with torch.no_grad():
                torch._foreach_lerp_(following, online, self.tau)
        self._n_updates += gradient_steps

    def train_critics(self, gradient_steps: int, batch_size: int) -> None:
        """Update the critics alone, so that they know what the actor is worth as it is.

        Args:
            gradient_steps: Number of updates.
            batch_size: Number of transitions of each update.
        """
        assert self.log_ent_coef is not None
        ent_coef = self.log_ent_coef.detach().exp()
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)  # type: ignore[union-attr]
            self._update_critic(batch, ent_coef)
            with torch.no_grad():
                torch._foreach_lerp_(self._target.tensors, self._online.tensors, self.tau)

    @contextmanager
    def _threads(self) -> Iterator[None]:
        """Two threads where there is a core for the second: a critic each, so that no sum changes.

        The actor has one: a second would divide the sums of its last layer's gradient, and that
        shows in the last digit.
        """
        torch.set_num_threads(2 if self.core_to_spare() else 1)
        try:
            yield
        finally:
            torch.set_num_threads(1)

    def _act(self, observations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Actions drawn from the policy, and the logarithm of their density, shape (n, 1)."""
        mean, log_std = self.distribution(observations)
        noise = torch.randn_like(mean)
        actions = torch.tanh(mean + log_std.exp() * noise)
        gaussian = -0.5 * noise * noise - log_std - LOG_SQRT_TAU
        squash = torch.log(1.0 - actions * actions + SQUASH_EPSILON)
        return actions, (gaussian - squash).sum(dim=1, keepdim=True)

    def distribution(self, observations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Mean and logarithm of the deviation, before tanh, each of shape (n, axes)."""
        hidden = observations
        for weight, bias in self._hidden:
            hidden = functional.linear(hidden, weight, bias).relu()
        mean, log_std = self.actor.mu(hidden), self.actor.log_std(hidden)  # type: ignore[operator]
        return mean, log_std.clamp(LOG_STD_MIN, LOG_STD_MAX)

    def _update_ent_coef(self, log_prob: torch.Tensor) -> torch.Tensor:
        """Move the entropy's weight towards the target entropy; the weight before that."""
        assert self.log_ent_coef is not None
        assert self.ent_coef_optimizer is not None
        weight = self.log_ent_coef.detach().exp()
        # The gradient of -(log_ent_coef * (log_prob + target_entropy)).mean()
        self.log_ent_coef.grad = -(log_prob.detach().mean() + float(self.target_entropy))[None]
        self.ent_coef_optimizer.step()
        return weight

    @torch.no_grad()
    def _update_critic(self, batch: Any, ent_coef: torch.Tensor) -> None:
        actions, log_prob = self._act(batch.next_observations)
        with self._threads():
            q1, q2 = self._target(batch.next_observations, actions).values
            value = torch.minimum(q1, q2)
            value -= ent_coef * log_prob
            target_q_values = batch.rewards + (1.0 - batch.dones) * self.gamma * value
            forward = self._online(batch.observations, batch.actions)
            # Of the mean squared error of both, which is half of the sum of their losses.
            gradient = (forward.values - target_q_values).mul_(2.0 / forward.values.numel())
            gradients = self._online.weight_gradients(forward, gradient)
        _descend(self.critic.optimizer, self._online.tensors, gradients)

    def _update_actor(
        self,
        observations: torch.Tensor,
        actions: torch.Tensor,
        log_prob: torch.Tensor,
        ent_coef: torch.Tensor,
    ) -> None:
        """Raise value and entropy of actions: lower (weight · log_prob - min value).mean().

        Args:
            observations: Observations, shape (n, size).
            actions: Actions drawn from the policy, with their gradient, shape (n, axes).
            log_prob: Logarithm of the actions' density, with its gradient, shape (n, 1).
            ent_coef: Weight of the entropy.
        """
        n, axes = actions.shape
        with torch.no_grad(), self._threads():
            forward = self._online(observations, actions)
            by_values = _share_in_minimum(forward.values).mul_(-1.0 / n)
            by_actions = self._online.action_gradient(forward, by_values, axes)
            self._add_to_gradient(by_actions, observations, actions, forward.values)
            by_log_prob = (ent_coef / n).expand_as(log_prob)
        gradients = torch.autograd.grad(
            (actions, log_prob), self._actor_weights, (by_actions, by_log_prob)
        )
        _descend(self.actor.optimizer, self._actor_weights, gradients)

    def _add_to_gradient(
        self,
        by_actions: torch.Tensor,
        observations: torch.Tensor,
        actions: torch.Tensor,
        values: torch.Tensor,
    ) -> None:
        """Add to the gradient of the actor's loss by actions what a subclass wants of them.

        Args:
            by_actions: Gradient, shape (n, axes), which is changed in place.
            observations: Observations, shape (n, size).
            actions: Actions drawn from the policy, shape (n, axes).
            values: Values of the actions by both critics, shape (2, n, 1).
        """


def _share_in_minimum(values: torch.Tensor) -> torch.Tensor:
    """The gradient of the smaller of two values by each of them; they share it where equal."""
    q1, q2 = values
    first = (q1 < q2).to(values.dtype).add_((q1 == q2).to(values.dtype), alpha=0.5)
    return torch.stack([first, 1.0 - first])


def _descend(
    optimizer: torch.optim.Optimizer,
    weights: Sequence[torch.Tensor],
    gradients: Sequence[torch.Tensor],
) -> None:
    """Take a step of the optimizer along gradients."""
    for weight, gradient in zip(weights, gradients, strict=True):
        weight.grad = gradient
    optimizer.step()
