# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC whose actions are a choice and the numbers that the choice takes. Needs torch.

The policy has two levels, as MAPLE's (Nasiriany et al. 2022, §III): a categorical distribution over
choices, and for each choice a Gaussian of its own numbers, kept within (-1, 1) by tanh. Critics
judge a choice with its numbers. Since choices are few, what SAC expects over them is a sum, not a
sample (Christodoulou 2019), and each level has an entropy of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.policies import ContinuousCritic
from stable_baselines3.common.torch_layers import create_mlp
from stable_baselines3.common.type_aliases import DictReplayBufferSamples, PyTorchObs
from stable_baselines3.common.utils import polyak_update
from stable_baselines3.sac.policies import Actor, MultiInputPolicy
from torch import nn
from torch.nn import functional

from slap_ros.baselines.scores import SHARPNESS
from slap_ros.environments.controls import ChoiceSpace

CHOICE_ENTROPY = 0.5  # of choices that SAC aims at, as a share of that of random ones
SMALLEST = 1e-6  # derivative of tanh


@dataclass(frozen=True)
class ProposedActions:
    """What a policy would do in each of n states.

    Args:
        log_choice: Logarithm of the probability of each choice, shape (n, choices).
        numbers: Numbers of all choices, one after the other, shape (n, numbers).
        log_numbers: Logarithm of the density of the numbers that each choice takes, shape (n,
            choices).
    """

    log_choice: torch.Tensor
    numbers: torch.Tensor
    log_numbers: torch.Tensor

    def mean(self, values: torch.Tensor) -> torch.Tensor:
        """The mean over choices of what there is for each, shape (n, choices) to (n, 1)."""
        return (self.log_choice.exp() * values).sum(dim=1, keepdim=True)

    @property
    def log_probs(self) -> torch.Tensor:
        """Expected logarithms of the probabilities of choice and numbers, shape (n, 2)."""
        return torch.cat([self.mean(self.log_choice), self.mean(self.log_numbers)], dim=1)


def slots_of(space: ChoiceSpace) -> torch.Tensor:
    """Where critics see the numbers that each choice takes: in the same slots, the first ones.

    So what is learned of a point for one choice is known of it for the others.

    Args:
        space: Space of the actions.

    Returns:
        1 where a slot has a number of a choice, shape (choices, numbers, slots); there are as many
        slots as numbers.
    """
    slots = torch.zeros(len(space.sizes), sum(space.sizes), sum(space.sizes))
    for choice, numbers in enumerate(space.takes):
        for slot, number in enumerate(np.flatnonzero(numbers)):
            slots[choice, number, slot] = 1.0
    return slots


class HybridActor(Actor):
    """SAC's actor, the first outputs of which are scores of choices."""

    def __init__(self, *args: Any, **options: Any) -> None:
        """See stable-baselines3."""
        super().__init__(*args, **options)
        assert isinstance(self.action_space, ChoiceSpace)
        self.takes = torch.as_tensor(self.action_space.takes, dtype=torch.float32)
        self.slots = slots_of(self.action_space)

    def propose(self, observations: PyTorchObs) -> ProposedActions:
        """Probabilities of choices, and numbers for each, with the noise of exploring."""
        mean, log_std, _ = self.get_action_dist_params(observations)
        count = len(self.takes)
        log_choice = functional.log_softmax(SHARPNESS * torch.tanh(mean[:, :count]), dim=1)
        normal = torch.distributions.Normal(mean[:, count:], log_std[:, count:].exp())
        raw = normal.rsample()
        numbers = torch.tanh(raw)
        density = normal.log_prob(raw)  # type: ignore[no-untyped-call]
        density = density - torch.log(1.0 - numbers.square() + SMALLEST)
        return ProposedActions(log_choice, numbers, density @ self.takes.T)

    def forward(self, obs: PyTorchObs, deterministic: bool = False) -> torch.Tensor:
        """An action: 1 for the choice, -1 for the others, and the numbers of all."""
        if deterministic:
            return torch.tanh(self.get_action_dist_params(obs)[0])
        proposed = self.propose(obs)
        chosen = torch.multinomial(proposed.log_choice.exp(), 1).squeeze(1)
        scores = 2.0 * functional.one_hot(chosen, len(self.takes)) - 1.0
        return torch.cat([scores, proposed.numbers], dim=1)


class NormalisedCritic(ContinuousCritic):
    """SAC's critics with normalised hidden layers, as acquired skills have them."""

    def __init__(self, **options: Any) -> None:
        """Make the critics.

        Args:
            options: Arguments of stable-baselines3's critics.
        """
        super().__init__(**options)
        assert isinstance(self.action_space, ChoiceSpace)
        size, net_arch = options["features_dim"] + self.action_space.shape[0], options["net_arch"]
        for number in range(self.n_critics):
            layers = create_mlp(size, 1, net_arch, post_linear_modules=[nn.LayerNorm])
            self.q_networks[number] = nn.Sequential(*layers)
            setattr(self, f"qf{number}", self.q_networks[number])


class HybridPolicy(MultiInputPolicy):
    """SAC's networks with an actor that chooses, and normalised critics."""

    def make_actor(self, features_extractor: Any = None) -> Actor:
        """See stable-baselines3."""
        options = self._update_features_extractor(self.actor_kwargs, features_extractor)
        return HybridActor(**options).to(self.device)

    def make_critic(self, features_extractor: Any = None) -> ContinuousCritic:
        """See stable-baselines3."""
        options = self._update_features_extractor(self.critic_kwargs, features_extractor)
        return NormalisedCritic(**options).to(self.device)


class HybridSac(SAC):
    """Soft actor-critic with both levels of the policy, in a :class:`ChoiceSpace`."""

    policy_aliases = {"MultiInputPolicy": HybridPolicy}  # noqa: RUF012 -- stable-baselines3's own

    def _setup_model(self) -> None:
        """Weigh the entropies of choices and of numbers apart."""
        super()._setup_model()
        assert self.log_ent_coef is not None
        both = self.log_ent_coef.detach().repeat(2)
        self.log_ent_coef = both.requires_grad_(True)
        self.ent_coef_optimizer = torch.optim.Adam([both], lr=self.lr_schedule(1))

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Update actor, critics and weights of entropy so many times."""
        self.policy.set_training_mode(True)
        for _ in range(gradient_steps):
            assert self.replay_buffer is not None
            samples = self.replay_buffer.sample(batch_size)
            assert isinstance(samples, DictReplayBufferSamples)
            actor = self.actor
            assert isinstance(actor, HybridActor)
            proposed = actor.propose(samples.observations)
            weights = self._weigh_entropies(proposed, actor.takes)
            self._learn_values(samples, actor, weights)
            values = self._values(self.critic, samples.observations, proposed, actor)
            _descend(actor.optimizer, _actor_loss(proposed, values, weights))
            polyak_update(self.critic.parameters(), self.critic_target.parameters(), self.tau)
        self._n_updates += gradient_steps

    def _weigh_entropies(self, proposed: ProposedActions, takes: torch.Tensor) -> torch.Tensor:
        """The weights of both entropies, shape (2,), which are then updated.

        Numbers have the entropy that SAC has: -1 for each that is taken.
        """
        assert self.log_ent_coef is not None
        assert self.ent_coef_optimizer is not None
        weights = self.log_ent_coef.detach().exp()
        choice = torch.full((len(proposed.numbers), 1), CHOICE_ENTROPY * float(np.log(len(takes))))
        wanted = torch.cat([choice, -proposed.mean(takes.sum(dim=1)[None])], dim=1)
        missing = (proposed.log_probs + wanted).detach().mean(dim=0)
        _descend(self.ent_coef_optimizer, -(self.log_ent_coef * missing).sum())
        return weights

    def _learn_values(
        self, samples: DictReplayBufferSamples, actor: HybridActor, weights: torch.Tensor
    ) -> None:
        """Update the critics towards what follows the actions that were taken."""
        with torch.no_grad():
            after = actor.propose(samples.next_observations)
            values = self._values(self.critic_target, samples.next_observations, after, actor)
            value = after.mean(values) - (after.log_probs @ weights)[:, None]
            target = samples.rewards + (1.0 - samples.dones) * self.gamma * value
        count = len(actor.takes)
        chosen = functional.one_hot(samples.actions[:, :count].argmax(dim=1), count).float()
        taken = torch.einsum("np,nc,cps->ns", samples.actions[:, count:], chosen, actor.slots)
        judged = self.critic(samples.observations, torch.cat([chosen, taken], dim=1))
        losses = [functional.mse_loss(one, target) for one in judged]
        _descend(self.critic.optimizer, 0.5 * torch.stack(losses).sum())

    @staticmethod
    def _values(
        critic: ContinuousCritic,
        observations: PyTorchObs,
        proposed: ProposedActions,
        actor: HybridActor,
    ) -> torch.Tensor:
        """The lesser of the critics' values of each choice with its numbers, (n, choices)."""
        n, count = proposed.log_choice.shape
        taken = torch.einsum("np,cps->ncs", proposed.numbers, actor.slots)
        each = torch.cat([torch.eye(count).expand(n, -1, -1), taken], dim=2).reshape(n * count, -1)
        assert isinstance(observations, dict)
        repeated = {
            name: part.repeat_interleave(count, dim=0) for name, part in observations.items()
        }
        return torch.cat(critic(repeated, each), dim=1).min(dim=1).values.reshape(n, count)


def _actor_loss(
    proposed: ProposedActions, values: torch.Tensor, weights: torch.Tensor
) -> torch.Tensor:
    """What both levels of the policy are to make small.

    The numbers of each choice are learned however seldom it is chosen: weighed by its probability,
    as the expectation has it, a choice would be given up before it is known where it acts.

    Args:
        proposed: What the policy would do.
        values: Values of each choice with its numbers, shape (n, choices).
        weights: Weights of the entropies of choice and numbers, shape (2,).
    """
    costs = weights[1] * proposed.log_numbers - values
    choice = proposed.mean(weights[0] * proposed.log_choice + costs.detach())
    return choice.mean() + costs.sum(dim=1).mean()


def _descend(optimizer: torch.optim.Optimizer, loss: torch.Tensor) -> None:
    """One step of an optimiser."""
    optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    optimizer.step()
