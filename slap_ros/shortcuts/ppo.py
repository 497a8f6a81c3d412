# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proximal policy optimisation (Schulman et al. 2017) of one shortcut. Needs torch.

The algorithm is stable-baselines3's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from slap_ros.learning.checkpoint import load_checkpoint, save_checkpoint
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.ppo import make_ppo
from slap_ros.learning.vec_env import VecEnv
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.shortcuts.normalised_vec_env import NormalisedVecEnv
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.progress import Progress


class _RolloutCallback(BaseCallback):
    """Reports after each rollout, and stops when the answer is no."""

    def __init__(self, env: NormalisedVecEnv, report: Callable[[Progress], bool]) -> None:
        super().__init__()
        self._env, self._report, self._go_on = env, report, True

    def _on_rollout_end(self) -> None:
        self._go_on = self._report(self._env.progress(self.num_timesteps))

    def _on_step(self) -> bool:
        return self._go_on


class Learner:
    """PPO on the environments of one shortcut."""

    def __init__(
        self, env: VecEnv, normalisation: ObservationNormalisation, settings: PpoSettings, seed: int
    ) -> None:
        """Begin with random weights.

        Args:
            env: Environments of the shortcut.
            normalisation: Normalisation of observations.
            settings: PPO's hyper-parameters.
            seed: Seed of weights and noise.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings = settings
        self._env = NormalisedVecEnv(env, normalisation)
        self._ppo = make_ppo(self._env, settings, self._rate, seed)

    def _rate(self, remaining: float) -> float:
        rate = self.settings.learning_rate
        return rate * max(0.05, remaining) if self.settings.anneal else rate

    def learn(self, report: Callable[[Progress], bool], logs: Path | None = None) -> None:
        """Train until the steps are used up or ``report`` answers no.

        Args:
            report: Function that is called after each rollout; it returns whether learning
                continues.
            logs: Folder for TensorBoard's files; None for no files.
        """
        if logs is not None:
            self._ppo.set_logger(configure(str(logs), ["tensorboard"]))
        callback = _RolloutCallback(self._env, report)
        steps = self.settings.total_steps - self._ppo.num_timesteps
        if steps > 0:
            self._ppo.learn(steps, callback=callback, reset_num_timesteps=False)

    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch."""
        weights = weights_of(self._ppo.policy)
        hidden = hidden_layers("mlp_extractor.policy_net", len(self.settings.net_arch))
        layers = exported_layers(weights, [*hidden, "action_net"])
        return MlpPolicy(self._env.normalisation, layers, weights["log_std"])

    def _weights(self) -> dict[str, torch.Tensor]:
        return dict(self._ppo.policy.state_dict())

    @property
    def shortest(self) -> int:
        """Environment steps of the shortest success; the horizon where there is none."""
        return self._env.shortest

    def initialise_from(self, earlier: Learner) -> None:
        """Begin with the weights of an earlier learner, but with this one's noise."""
        weights = earlier._weights()
        weights["log_std"] = torch.full_like(weights["log_std"], self.settings.log_std_init)
        self._ppo.policy.load_state_dict(weights)
        self._env.shortest = earlier._env.shortest

    def save(self, path: Path) -> None:
        """Write a checkpoint. One that is there stays whole until the new one is."""
        save_checkpoint(
            path,
            {
                "steps": self._ppo.num_timesteps,
                "shortest": self._env.shortest,
                "policy": self._ppo.policy.state_dict(),
                "optimizer": self._ppo.policy.optimizer.state_dict(),
            },
        )

    def resume(self, path: Path) -> None:
        """Continue from a checkpoint. Episodes begin again.

        Raises:
            InvalidParameterError: It is damaged.
        """
        saved = read_checkpoint(path)
        self._ppo.policy.load_state_dict(saved["policy"])
        self._ppo.policy.optimizer.load_state_dict(saved["optimizer"])
        self._ppo.num_timesteps = saved["steps"]
        self._env.shortest = saved["shortest"]


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what :meth:`Learner.save` wrote.

    Raises:
        InvalidParameterError: It is damaged.
    """
    return load_checkpoint(path, _restored, "remove it to learn this stage again")


def _restored(saved: Mapping[str, Any]) -> dict[str, Any]:
    """The checkpoint that :meth:`Learner.save` wrote, with values of the right types."""
    return {
        "steps": int(saved["steps"]),
        "shortest": int(saved["shortest"]),
        "policy": dict(saved["policy"]),
        "optimizer": dict(saved["optimizer"]),
    }
