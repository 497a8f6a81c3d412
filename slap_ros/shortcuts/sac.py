# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic (Haarnoja et al. 2018) of shortcuts, in place of PPO. Needs torch.

SLAP's Table 3 compares both. The algorithm is stable-baselines3's. What planning tries out has the
noise of the actor, made independent of the state, on the actions of the recent observations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from slap_ros.learning.checkpoint import load_checkpoint, save_checkpoint
from slap_ros.learning.policy_export import exported_layers, hidden_layers, weights_of
from slap_ros.learning.sac import make_sac
from slap_ros.learning.sac_state import restore_sac, sac_state
from slap_ros.learning.vec_env import VecEnv
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.shortcuts.normalised_vec_env import NormalisedVecEnv
from slap_ros.shortcuts.progress import Progress
from slap_ros.shortcuts.relabelling import RelabelledVecEnv, RelabellingBuffer
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings

REPORTED_STEPS = 2_000  # environment steps between reports
RECENT_ROWS = 64  # rows of the replay buffer over which the noise is measured
LEAST_STD = 1e-3  # of an action's noise, where the range is 2


def recent_observations(buffer: ReplayBuffer) -> NDArray[np.float32]:
    """The last observations of a replay buffer, shape (n, size); of an empty one, zeros.

    Args:
        buffer: Replay buffer, whose rows are written in turn.
    """
    written = buffer.buffer_size if buffer.full else buffer.pos
    rows = min(max(written, 1), RECENT_ROWS)
    # A full buffer begins again with its first row: before that one is the last.
    seen: NDArray[np.float32] = buffer.observations[np.arange(buffer.pos - rows, buffer.pos)]
    return seen.reshape(-1, seen.shape[-1])


class _ReportCallback(BaseCallback):
    """Reports now and then, and stops when the answer is no."""

    def __init__(self, env: NormalisedVecEnv, report: Callable[[Progress], bool]) -> None:
        super().__init__()
        self._env, self._report = env, report
        self._next = 0

    def _on_step(self) -> bool:
        if self.num_timesteps < self._next:
            return True
        self._next = self.num_timesteps + REPORTED_STEPS
        return self._report(self._env.progress(self.num_timesteps))


class SacLearner:
    """SAC on the environments of shortcuts."""

    def __init__(
        self,
        env: VecEnv,
        normalisation: ObservationNormalisation,
        settings: ShortcutSacSettings,
        seed: int,
    ) -> None:
        """Begin with random weights and no transitions.

        Args:
            env: Environments of the shortcuts.
            normalisation: Normalisation of observations.
            settings: SAC's hyper-parameters.
            seed: Seed of weights and noise.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings = settings
        self._env = RelabelledVecEnv(env, normalisation)
        self._sac = make_sac(
            self._env,
            settings,
            seed,
            replay=RelabellingBuffer,
            replay_buffer_kwargs={"share": settings.hindsight},
            buffer_size=settings.buffer_size,
            learning_starts=settings.learning_starts,
        )

    def learn(self, report: Callable[[Progress], bool], logs: Path | None = None) -> None:
        """Train until the steps are used up or ``report`` answers no.

        Args:
            report: Function that is called now and then, and in the end; it returns whether
                learning continues.
            logs: Folder for TensorBoard's files; None for no files.
        """
        if logs is not None:
            self._sac.set_logger(configure(str(logs), ["tensorboard"]))
        steps = self.settings.total_steps - self._sac.num_timesteps
        if steps > 0:
            callback = _ReportCallback(self._env, report)
            self._sac.learn(steps, callback, reset_num_timesteps=False)
            report(self._env.progress(self._sac.num_timesteps))

    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch."""
        weights = weights_of(self._sac.actor)
        names = [*hidden_layers("latent_pi", len(self.settings.net_arch)), "mu"]
        layers = exported_layers(weights, names)
        noise = np.log(np.maximum(self._noise(), LEAST_STD)).astype(np.float32)
        return MlpPolicy(self._env.normalisation, layers, noise, "relu", squashed=True)

    def _noise(self) -> NDArray[np.float32]:
        """Standard deviation of each action's noise, mean over recent observations."""
        buffer = self._sac.replay_buffer
        assert buffer is not None
        seen = recent_observations(buffer)
        with torch.no_grad():
            flat = torch.as_tensor(seen)
            mean, log_std, _ = self._sac.actor.get_action_dist_params(flat)
            # of the squashed action, to first order
            spread = torch.exp(log_std) * (1.0 - torch.tanh(mean) ** 2)
        found: NDArray[np.float32] = spread.mean(dim=0).numpy()
        return found

    @property
    def shortest(self) -> int:
        """Environment steps of the shortest success; the horizon where there is none."""
        return self._env.shortest

    def save(self, path: Path) -> None:
        """Write a checkpoint, without transitions. One that is there stays until the new one is."""
        save_checkpoint(path, {"shortest": self._env.shortest, **sac_state(self._sac)})

    def resume(self, path: Path) -> None:
        """Continue from a checkpoint. Episodes begin again, and transitions are collected again.

        Raises:
            InvalidParameterError: It is damaged.
        """
        load_checkpoint(path, self._go_on_from, "remove it to learn this stage again")

    def _go_on_from(self, saved: Mapping[str, Any]) -> None:
        restore_sac(self._sac, saved)
        self._env.shortest = int(saved["shortest"])
        self._sac.learning_starts = self._sac.num_timesteps + self.settings.learning_starts
