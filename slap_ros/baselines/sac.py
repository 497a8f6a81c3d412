# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic of whole tasks, rewarded for the stages of their plans. Needs torch.

LG-SAIL's flat baseline (§5, Fig. 4 and Table 1): one policy for all of a task, which observes all
objects and the goal. The reward is the sum over the stages of the task's plan, dense within the
present one. The algorithm is stable-baselines3's (Haarnoja et al. 2018).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import DictReplayBuffer

from slap_ros.baselines.budgeted_learner import BudgetedLearner
from slap_ros.baselines.method import Method
from slap_ros.baselines.stored_transitions import restore_transitions, transitions_of
from slap_ros.baselines.training_envs import TrainingEnvs, as_observed, separate_envs
from slap_ros.files import write_whole
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.sac import SacNumbers, make_sac
from slap_ros.learning.sac_state import restore_sac, sac_state
from slap_ros.learning.work_folder import damaged
from slap_ros.policies.mlp_policy import MlpPolicy

REPLAY = "replay.npz"
NO_NOISE = -20.0  # logarithm of a standard deviation


class SacTaskNumbers(SacNumbers, Protocol):
    """Hyper-parameters of SAC on whole tasks."""

    @property
    def total_steps(self) -> int: ...  # noqa: D102 -- environment steps


class SacTaskLearner(BudgetedLearner):
    """SAC on the training tasks, whose transitions are kept when it is interrupted."""

    def __init__(
        self,
        settings: SacTaskNumbers,
        envs: TrainingEnvs,
        seed: int,
        replay: type[DictReplayBuffer],
        **options: Any,
    ) -> None:
        """Begin with random weights and no transitions.

        Args:
            settings: Hyper-parameters.
            envs: Environments of the training tasks, with goals among their observations.
            seed: Seed of weights and noise.
            replay: Kind of replay buffer.
            options: Further arguments of stable-baselines3's SAC, such as the buffer's size.
        """
        self._hidden = len(settings.net_arch)
        self._sac: SAC = make_sac(
            envs.make(), settings, seed, policy="MultiInputPolicy", replay=replay, **options
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
        np.savez(whole, allow_pickle=False, **self._transitions())
        write_whole(folder / REPLAY, whole.getvalue())
        super().save(folder)

    def resume(self, folder: Path) -> None:
        """See :class:`~slap_ros.baselines.method.TaskLearner`."""
        super().resume(folder)
        try:
            with np.load(folder / REPLAY, allow_pickle=False) as arrays:
                self._restore_transitions(arrays)
        except Exception as error:  # numpy says in several ways that a file is damaged
            advice = "remove the folder to train from the beginning"
            raise damaged(folder / REPLAY, type(error).__name__, advice) from error

    @property
    def buffer(self) -> DictReplayBuffer:
        """The replay buffer that is learned from."""
        buffer = self._sac.replay_buffer
        assert isinstance(buffer, DictReplayBuffer)
        return buffer

    def _transitions(self) -> dict[str, NDArray[Any]]:
        return transitions_of(self.buffer)

    def _restore_transitions(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        restore_transitions(self.buffer, arrays)


@dataclass(frozen=True)
class StagedSacSettings:
    """Hyper-parameters, those of acquired skills where both have them."""

    n_envs: int = 8
    buffer_size: int = 200_000  # transitions
    learning_starts: int = 1_600  # environment steps with random actions
    batch_size: int = 128
    learning_rate: float = 1e-3
    ent_coef_init: float = 0.1  # weight of entropy at first; it is learned
    tau: float = 0.005
    gamma: float = 0.99  # whole tasks are longer than a skill
    train_freq: int = 1  # actions in each environment between updates
    gradient_steps: int = 4
    net_arch: tuple[int, ...] = (256, 256)
    total_steps: int = 150_000  # environment steps
    validation: int = 20  # tasks on which the policy is tried in the end


class StagedSacLearner(SacTaskLearner):
    """SAC with a replay buffer of what happened, and nothing else."""

    def __init__(self, settings: StagedSacSettings, envs: TrainingEnvs, seed: int) -> None:
        """Begin with random weights and no transitions.

        Args:
            settings: Hyper-parameters.
            envs: Environments of the training tasks, with goals among their observations.
            seed: Seed of weights and noise.
        """
        super().__init__(
            settings,
            envs,
            seed,
            DictReplayBuffer,
            buffer_size=min(settings.buffer_size, settings.total_steps + settings.n_envs),
            learning_starts=settings.learning_starts,
        )


METHOD = Method(
    {"obs": "dict", "control": "joints", "reward": "stages"},
    {"ours": StagedSacSettings()},
    StagedSacLearner,
    separate_envs,
    noisy=False,
)
