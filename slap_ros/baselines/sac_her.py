# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic with hindsight experience replay of whole tasks. Needs torch.

SLAP §5, appendix C. Both algorithms are stable-baselines3's (Haarnoja et al. 2018, Andrychowicz et
al. 2017).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from slap_ros.baselines.budgeted_learner import BudgetedLearner
from slap_ros.baselines.hindsight_buffer import HindsightBuffer
from slap_ros.baselines.method import Method
from slap_ros.baselines.training_envs import TrainingEnvs, as_observed, separate_envs
from slap_ros.files import write_whole
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.sac import make_sac
from slap_ros.learning.sac_state import restore_sac, sac_state
from slap_ros.learning.work_folder import damaged
from slap_ros.policies.mlp_policy import MlpPolicy

REPLAY = "replay.npz"
NO_NOISE = -20.0  # logarithm of a standard deviation


@dataclass(frozen=True)
class HerSettings:
    """Hyper-parameters of SAC and hindsight, under the names of stable-baselines3."""

    n_envs: int = 8
    buffer_size: int = 1_000_000  # transitions
    learning_starts: int = 1_000  # environment steps with random actions, one episode at least
    batch_size: int = 256
    learning_rate: float = 3e-4
    ent_coef_init: float = 1.0  # weight of entropy at first; it is learned
    tau: float = 0.005
    gamma: float = 0.99
    train_freq: int = 1  # actions in each environment between updates
    gradient_steps: int = 1
    n_sampled_goal: int = 4  # virtual transitions for each real one
    net_arch: tuple[int, ...] = (256, 256)
    total_steps: int = 1_000_000  # environment steps
    validation: int = 20  # tasks on which it is decided whether the policy acts with its noise


OURS = HerSettings()


class SacHerLearner(BudgetedLearner):
    """SAC on the training tasks, with goals that were reached later in the same episode."""

    def __init__(self, settings: HerSettings, envs: TrainingEnvs, seed: int) -> None:
        """Begin with random weights and no transitions.

        Args:
            settings: Hyper-parameters.
            envs: Environments of the training tasks, with goals among their observations.
            seed: Seed of weights and noise.
        """
        self._hidden = len(settings.net_arch)
        first_episode = settings.n_envs * (envs.step_limit + 1)
        self._sac = make_sac(
            envs.make(),
            settings,
            seed,
            policy="MultiInputPolicy",
            replay=HindsightBuffer,
            replay_buffer_kwargs={
                "n_sampled_goal": settings.n_sampled_goal,
                "goal_selection_strategy": "future",
            },
            buffer_size=min(settings.buffer_size, settings.total_steps + first_episode),
            learning_starts=max(settings.learning_starts, first_episode),
        )
        super().__init__(self._sac, envs, settings.total_steps, seed)

    def policy(self) -> MlpPolicy:
        """The most likely actions; see :class:`~slap_ros.baselines.method.TaskLearner`."""
        weights = weights_of(self._sac.actor)
        layers = exported_layers(weights, [*hidden_layers("latent_pi", self._hidden), "mu"])
        quiet = np.full(len(layers[-1][1]), NO_NOISE, np.float32)
        return MlpPolicy(as_observed(layers[0][0].shape[1]), layers, quiet, "relu", squashed=True)

    def state(self) -> dict[str, Any]:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        return sac_state(self._sac)

    def restore(self, saved: Mapping[str, Any]) -> None:
        """See :class:`~slap_ros.baselines.budgeted_learner.BudgetedLearner`."""
        restore_sac(self._sac, saved)

    # -- transitions ------------------------------------------------------------------------------

    def save(self, folder: Path) -> None:
        """Write a checkpoint, and all transitions beside it."""
        whole = BytesIO()
        np.savez(whole, allow_pickle=False, **self._buffer.arrays())
        write_whole(folder / REPLAY, whole.getvalue())
        super().save(folder)

    def resume(self, folder: Path) -> None:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        super().resume(folder)
        try:
            with np.load(folder / REPLAY, allow_pickle=False) as arrays:
                self._buffer.restore(arrays)
        except Exception as error:  # numpy says in several ways that a file is damaged
            advice = "remove the folder to train from the beginning"
            raise damaged(folder / REPLAY, type(error).__name__, advice) from error

    @property
    def _buffer(self) -> HindsightBuffer:
        buffer = self._sac.replay_buffer
        assert isinstance(buffer, HindsightBuffer)
        return buffer


METHOD = Method(
    {"obs": "dict", "control": "joints", "reward": "sparse"},
    {"ours": OURS, "paper": replace(OURS, n_envs=1, batch_size=16)},
    SacHerLearner,
    separate_envs,
    noisy=False,
)
