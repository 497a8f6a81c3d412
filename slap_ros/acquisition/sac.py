# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic of one skill. Needs torch.

The algorithm is stable-baselines3's (Haarnoja et al. 2018), with a replay buffer of ours. Training
goes in segments of whole episodes. Between them everything that it depends on can be written down,
so that one that is resumed there ends with the same weights.
"""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.logger import Logger

from slap_ros.acquisition.episodes import Episodes
from slap_ros.acquisition.observations import SIZE
from slap_ros.acquisition.replay_buffer import SkillReplayBuffer
from slap_ros.acquisition.sac_settings import SacSettings
from slap_ros.acquisition.sac_update import LeanSac
from slap_ros.acquisition.skill_env import SkillVecEnv
from slap_ros.errors import InvalidParameterError
from slap_ros.files import read_bytes
from slap_ros.learning.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.learning.stable_baselines import StableBaselinesVecEnv

MAX_CHECKPOINT_BYTES = 2**30
ONE = np.ones(SIZE, dtype=np.float32)
AS_OBSERVED = ObservationNormalisation(0.0 * ONE, ONE)  # clipped alone: any skill can begin another


class SkillLearner:
    """SAC on the episodes of one skill."""

    def __init__(self, env: SkillVecEnv, settings: SacSettings, seed: int) -> None:
        """Begin with random weights and an empty buffer.

        Args:
            env: Of the skill.
            settings: SAC's hyper-parameters.
            seed: Of weights, noise and batches.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings, self._env = settings, env
        actions = env.action_map.size
        self._sac = LeanSac(
            "MlpPolicy",
            StableBaselinesVecEnv(env, AS_OBSERVED),
            learning_rate=settings.learning_rate,
            buffer_size=settings.capacity,
            learning_starts=settings.random_steps,
            batch_size=settings.batch_size,
            tau=settings.tau,
            gamma=settings.discount,
            train_freq=1,
            gradient_steps=settings.environments // settings.steps_per_update,
            replay_buffer_class=SkillReplayBuffer,
            replay_buffer_kwargs={"mdp": env.mdp, "normalisation": AS_OBSERVED, "seed": seed},
            target_entropy=settings.entropy_per_action * actions,
            policy_kwargs={
                "net_arch": list(settings.hidden),
                "optimizer_kwargs": {"fused": True},
            },
            seed=seed,
            device="cpu",
        )
        self._sac.set_logger(Logger(None, []))

    @property
    def buffer(self) -> SkillReplayBuffer:
        """What is learned from."""
        assert isinstance(self._sac.replay_buffer, SkillReplayBuffer)
        return self._sac.replay_buffer

    @property
    def steps(self) -> int:
        """Environment steps so far."""
        return self._sac.num_timesteps

    def learn(self, rounds: int) -> Episodes:
        """Run whole episodes in all environments, and learn meanwhile.

        Args:
            rounds: Episodes in each environment.

        Returns:
            These episodes; the buffer has them.
        """
        self._sac.learn(
            rounds * self._env.horizon * self._env.num_envs,
            log_interval=None,  # type: ignore[arg-type]  # no log
            reset_num_timesteps=False,
        )
        episodes = self._env.take_episodes()
        assert episodes is not None
        self.buffer.add_episodes(episodes)
        return episodes

    def policy(self) -> MlpPolicy:
        """The policy as it is now, without torch, its most likely action squashed."""
        weights = {k: v.detach().numpy().copy() for k, v in self._sac.actor.state_dict().items()}
        hidden = [f"latent_pi.{2 * i}" for i in range(len(self.settings.hidden))]
        layers = tuple(
            (weights[f"{name}.weight"], weights[f"{name}.bias"]) for name in [*hidden, "mu"]
        )
        return MlpPolicy(AS_OBSERVED, layers, weights["log_std.bias"], "relu", squashed=True)

    def begin_with(self, policy: MlpPolicy) -> None:
        """Begin with the layers of another skill's policy; its noise is not taken over.

        Raises:
            InvalidParameterError: It has other layers.
        """
        now = self._sac.actor.state_dict()
        hidden = [f"latent_pi.{2 * i}" for i in range(len(self.settings.hidden))]
        names = [*hidden, "mu"]
        shapes = [tuple(now[f"{name}.weight"].shape) for name in names]
        if [layer.shape for layer, _ in policy.layers] != shapes:
            given = [layer.shape for layer, _ in policy.layers]
            raise InvalidParameterError(
                f"a policy with layers {given} is no beginning for one with layers {shapes}; "
                "learn with the same hidden layers"
            )
        for name, (weight, bias) in zip(names, policy.layers, strict=True):
            now[f"{name}.weight"].copy_(torch.from_numpy(weight))
            now[f"{name}.bias"].copy_(torch.from_numpy(bias))

    # -- checkpoints ------------------------------------------------------------------------------

    def save(self, path: Path) -> None:
        """Write a checkpoint, episodes not included. One that is there stays until it is whole."""
        sac, draft = self._sac, path.with_suffix(".draft")
        assert sac.log_ent_coef is not None
        assert sac.ent_coef_optimizer is not None
        torch.save(
            {
                "policy": sac.policy.state_dict(),
                "actor_optimizer": sac.actor.optimizer.state_dict(),
                "critic_optimizer": sac.critic.optimizer.state_dict(),
                "entropy_weight": sac.log_ent_coef.detach(),
                "entropy_optimizer": sac.ent_coef_optimizer.state_dict(),
                "steps": sac.num_timesteps,
                "torch_generator": torch.get_rng_state(),
                "buffer_generator": self.buffer.generator_state,
                "random_actions": json.dumps(sac.action_space.np_random.bit_generator.state),
            },
            draft,
        )
        draft.rename(path)

    def resume(self, path: Path, episodes: list[Episodes]) -> None:
        """Go on from a checkpoint.

        Args:
            path: Of the checkpoint.
            episodes: All that were run before it, in their order.

        Raises:
            InvalidParameterError: It is damaged.
        """
        saved, sac = read_checkpoint(path), self._sac
        assert sac.log_ent_coef is not None
        assert sac.ent_coef_optimizer is not None
        sac.policy.load_state_dict(saved["policy"])
        sac.actor.optimizer.load_state_dict(saved["actor_optimizer"])
        sac.critic.optimizer.load_state_dict(saved["critic_optimizer"])
        with torch.no_grad():
            sac.log_ent_coef.copy_(saved["entropy_weight"])
        sac.ent_coef_optimizer.load_state_dict(saved["entropy_optimizer"])
        sac.num_timesteps = saved["steps"]
        for some in episodes:
            self.buffer.add_episodes(some)
        self.buffer.generator_state = saved["buffer_generator"]
        sac.action_space.np_random.bit_generator.state = json.loads(saved["random_actions"])
        torch.set_rng_state(saved["torch_generator"])


def read_checkpoint(path: Path) -> dict[str, Any]:
    """What :meth:`SkillLearner.save` wrote. Only tensors and plain data are read, never code.

    Raises:
        InvalidParameterError: It is damaged.
    """
    try:
        saved = torch.load(BytesIO(read_bytes(path, MAX_CHECKPOINT_BYTES)), weights_only=True)
        return {**saved, "steps": int(saved["steps"])}
    except Exception as error:  # torch says in a dozen ways that a file is damaged
        raise InvalidParameterError(
            f"{path}: damaged: {type(error).__name__}; remove its folder to learn this skill again"
        ) from error
