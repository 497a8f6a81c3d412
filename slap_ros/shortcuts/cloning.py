# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Behavioural cloning (Pomerleau 1991) of a shortcut's demonstrations. Needs torch.

A clone that errs now and then is worth as much as the best of its attempts: planning tries a
shortcut out in the model, with noise, before it is used.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch

from slap_ros.learning.checkpoint import load_checkpoint, save_checkpoint
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.vec_env import VecEnv
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.demonstrations import Demonstrated
from slap_ros.shortcuts.normalised_vec_env import NormalisedVecEnv
from slap_ros.shortcuts.progress import Progress

LEAST_RATE = 0.05  # of the learning rate in the beginning


class CloningLearner:
    """Clones demonstrations, and then measures the policy in the environments of the shortcut."""

    def __init__(
        self,
        env: VecEnv,
        normalisation: ObservationNormalisation,
        settings: ShortcutCloningSettings,
        seed: int,
        shown: Demonstrated,
    ) -> None:
        """Begin with random weights.

        Args:
            env: Environments of the shortcut, in which the policy is measured.
            normalisation: Normalisation of observations.
            settings: Hyper-parameters.
            seed: Seed of weights, of the order of steps and of noise.
            shown: Steps of demonstrations.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings, self._seed, self._shown, self._raw = settings, seed, shown, env
        self._env = NormalisedVecEnv(env, normalisation)
        self._env.shortest = shown.shortest
        self._steps = 0
        sizes = (shown.observations.shape[1], *settings.net_arch)
        self._hidden = len(settings.net_arch)
        # The weights of new layers come from torch's own generator, which is put back.
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            layers: list[torch.nn.Module] = []
            for before, after in pairwise(sizes):
                layers += [torch.nn.Linear(before, after), torch.nn.Tanh()]
            last = torch.nn.Linear(sizes[-1], shown.actions.shape[1])
            self._network = torch.nn.Sequential(*layers, last)

    def learn(self, report: Callable[[Progress], bool], logs: Path | None = None) -> None:
        """Clone, and measure the policy until the environment steps are used up.

        Args:
            report: Function that is called in the end with the figures.
            logs: Not used: there is nothing to follow while it is learned.
        """
        del logs
        if self._steps:  # an earlier run has cloned
            return
        self._clone()
        rng, policy = np.random.default_rng([self._seed, len(self._shown.actions)]), self.policy()
        observations = self._raw.observations
        while self._steps < self.settings.total_steps:
            actions = policy.sample(observations, rng)
            step = self._raw.step(actions.astype(np.float64))
            observations = step.observations
            self._steps += self._raw.num_envs
            for i in np.flatnonzero(step.dones).tolist():
                self._env.count(step, i)
        report(self._env.progress(self._steps))

    def _clone(self) -> None:
        """Fit the network's actions to those of the demonstrations."""
        settings, order = self.settings, torch.Generator().manual_seed(self._seed)
        observations = torch.as_tensor(self._env.normalisation(self._shown.observations))
        actions = torch.as_tensor(self._shown.actions)
        optimiser = torch.optim.Adam(self._network.parameters(), lr=settings.learning_rate)
        for epoch in range(settings.epochs):
            left = max(LEAST_RATE, 1.0 - epoch / settings.epochs)
            optimiser.param_groups[0]["lr"] = settings.learning_rate * left
            shuffled = torch.randperm(len(actions), generator=order)
            for rows in torch.split(shuffled, settings.batch_size):
                errors = self._network(observations[rows]) - actions[rows]
                optimiser.zero_grad()
                errors.square().mean().backward()
                optimiser.step()

    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch."""
        weights = weights_of(self._network)
        names = [name.lstrip(".") for name in hidden_layers("", self._hidden + 1)]
        layers = exported_layers(weights, names)
        noise = np.full(self._shown.actions.shape[1], np.log(self.settings.noise), np.float32)
        return MlpPolicy(self._env.normalisation, layers, noise)

    @property
    def shortest(self) -> int:
        """Environment steps of the shortest success, demonstrations among them."""
        return self._env.shortest

    def save(self, path: Path) -> None:
        """Write a checkpoint. One that is there stays whole until the new one is."""
        weights = self._network.state_dict()
        saved = {"steps": self._steps, "shortest": self._env.shortest, "network": weights}
        save_checkpoint(path, saved)

    def resume(self, path: Path) -> None:
        """Continue from a checkpoint.

        Raises:
            InvalidParameterError: It is damaged.
        """
        load_checkpoint(path, self._go_on_from, "remove it to learn this stage again")

    def _go_on_from(self, saved: Mapping[str, Any]) -> None:
        self._network.load_state_dict(dict(saved["network"]))
        self._steps, self._env.shortest = int(saved["steps"]), int(saved["shortest"])
