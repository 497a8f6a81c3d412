# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic that begins with a known policy, and may be kept from losing it. Needs torch.

A good policy can be destroyed by critics that have seen random actions alone. Against that, the
known policy may act before the first update (jump-start: Uchendu et al. 2023), critics may be
trained before the policy is, and a term that fades may keep the policy near the known one
(kickstarting: Schmitt et al. 2018). :class:`WarmStartSettings` has each of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from slap_ros.acquisition.training.exploring_sac import ExploringSac
from slap_ros.acquisition.training.warm_start_settings import WarmStartSettings
from slap_ros.policies.mlp_policy import MlpPolicy


@dataclass(frozen=True)
class Guide:
    """A known policy that a learner begins with.

    Args:
        layers: Weights and biases of the policy's layers.
        settings: Settings of the warm start.
    """

    layers: Sequence[tuple[torch.Tensor, torch.Tensor]]
    settings: WarmStartSettings

    @classmethod
    def of(cls, policy: MlpPolicy, settings: WarmStartSettings) -> Guide:
        """The guide that a policy makes."""
        layers = [(torch.tensor(weight), torch.tensor(bias)) for weight, bias in policy.layers]
        return cls(layers, settings)

    def __call__(self, observations: torch.Tensor) -> torch.Tensor:
        """The most likely actions, shape (n, axes)."""
        *hidden, last = self.layers
        for layer in hidden:
            observations = functional.linear(observations, *layer).relu()
        return functional.linear(observations, *last).tanh()

    def cloning(self, steps: int) -> float:
        """The weight of the term that keeps actions near the guide's.

        Args:
            steps: Environment steps since the first update.
        """
        left = 1.0 - steps / max(self.settings.cloning_steps, 1)
        return self.settings.cloning * max(left, 0.0)


class GuidedSac(ExploringSac):
    """SAC that may begin with a guide; without one, or by default, it is the same to the bit."""

    guide: Guide | None = None

    def be_guided(self, guide: Guide) -> None:
        """Begin with a guide, whose layers the actor has already."""
        self.guide = guide
        assert self.log_ent_coef is not None
        with torch.no_grad():
            self.log_ent_coef.add_(math.log(guide.settings.entropy))
            for weights in (self.actor.state_dict(), self.averaged):
                weights["log_std.bias"].add_(math.log(guide.settings.noise))

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """See :meth:`LeanSac.train`; before the first update of all, critics learn alone.

        Args:
            gradient_steps: Number of updates.
            batch_size: Number of transitions of each update.
        """
        if self.guide is not None and self._is_first():
            self.train_critics(self.guide.settings.critic_updates, batch_size)
        super().train(gradient_steps, batch_size)

    def _is_first(self) -> bool:
        """Whether nothing was updated before: a function of the step, which checkpoints keep."""
        return self.num_timesteps - self.n_envs <= self.learning_starts

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        actions, _ = super()._sample_action(learning_starts, action_noise, n_envs)
        share = 0.0 if self.guide is None else self.guide.settings.acting
        if share > 0.0 and self.num_timesteps < learning_starts:
            known, _ = super()._sample_action(0, action_noise, n_envs)
            guided = self._guided(n_envs, share)
            actions[guided] = known[guided]
        return actions, actions

    @staticmethod
    def _guided(n_envs: int, share: float) -> NDArray[np.bool_]:
        """The environments in which the guide acts, spread evenly: which ones have other noise."""
        places = np.arange(n_envs + 1) * share
        guided: NDArray[np.bool_] = np.diff(np.floor(places + 0.5)) > 0
        return guided

    def _add_to_gradient(
        self,
        by_actions: torch.Tensor,
        observations: torch.Tensor,
        actions: torch.Tensor,
        values: torch.Tensor,
    ) -> None:
        """Draw actions to the guide's: the gradient of weight · |value| · mean (a - guide)²."""
        if self.guide is None:
            return
        weight = self.guide.cloning(self.num_timesteps - self.learning_starts)
        if weight > 0.0:
            scale = 2.0 * weight * float(values.abs().mean()) / len(actions)
            by_actions.add_(actions - self.guide(observations), alpha=scale)
