# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Soft actor-critic of one skill. Needs torch.

The algorithm is stable-baselines3's (Haarnoja et al. 2018), with a replay buffer of ours. Training
goes in segments of whole episodes. Between them everything that it depends on can be written down,
so that one that is resumed there ends with the same weights.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.logger import Logger

from slap_ros.acquisition.training.episodes import Episodes
from slap_ros.acquisition.training.guided_sac import Guide, GuidedSac
from slap_ros.acquisition.training.replay_buffer import SkillReplayBuffer
from slap_ros.acquisition.training.sac_settings import SacSettings
from slap_ros.acquisition.training.skill_env import SkillVecEnv
from slap_ros.acquisition.training.warm_start_settings import WarmStartSettings
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.checkpoint import load_checkpoint, save_checkpoint
from slap_ros.learning.policy_export import exported_layers, hidden_layers
from slap_ros.learning.stable_baselines import StableBaselinesVecEnv
from slap_ros.policies.mlp_policy import MlpPolicy, ObservationNormalisation
from slap_ros.skills.observations import SIZE

WORTH_A_THREAD = 128  # units of a critic's layer; with fewer, waking a second one takes longer
ONE = np.ones(SIZE, dtype=np.float32)
AS_OBSERVED = ObservationNormalisation(0.0 * ONE, ONE)  # clipped alone: any skill can begin another


class SkillLearner:
    """SAC on the episodes of one skill."""

    def __init__(
        self,
        env: SkillVecEnv,
        settings: SacSettings,
        seed: int,
        core_to_spare: Callable[[], bool] = lambda: False,
    ) -> None:
        """Begin with random weights and an empty buffer.

        Args:
            env: Environments of the skill.
            settings: Hyper-parameters of SAC.
            seed: Seed of weights, noise and batches.
            core_to_spare: Whether there is a second core to learn with just now. What is learned
                does not depend on it.
        """
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings, self._env = settings, env
        actions = env.action_map.size
        critic_hidden = list(settings.critic_net_arch or settings.net_arch)
        self._sac = GuidedSac(
            "MlpPolicy",
            StableBaselinesVecEnv(env, AS_OBSERVED),
            learning_rate=settings.learning_rate,
            buffer_size=settings.buffer_size,
            learning_starts=settings.learning_starts,
            batch_size=settings.batch_size,
            tau=settings.tau,
            gamma=settings.gamma,
            ent_coef=f"auto_{settings.ent_coef}",
            train_freq=1,
            gradient_steps=settings.n_envs // settings.train_freq,
            replay_buffer_class=SkillReplayBuffer,
            replay_buffer_kwargs={"mdp": env.mdp, "normalisation": AS_OBSERVED, "seed": seed},
            target_entropy=settings.entropy_per_action * actions,
            policy_kwargs={
                "net_arch": {"pi": list(settings.net_arch), "qf": critic_hidden},
                "optimizer_kwargs": {"fused": True},
            },
            seed=seed,
            device="cpu",
        )
        self._sac.longest_hold = settings.longest_hold
        if max(critic_hidden, default=0) >= WORTH_A_THREAD:
            self._sac.core_to_spare = core_to_spare
        if settings.critic_layer_norm:
            self._sac.normalise_critics()
        self._sac.set_logger(Logger(None, []))

    @property
    def buffer(self) -> SkillReplayBuffer:
        """The replay buffer that is learned from."""
        assert isinstance(self._sac.replay_buffer, SkillReplayBuffer)
        return self._sac.replay_buffer

    @property
    def steps(self) -> int:
        """The number of environment steps so far."""
        return self._sac.num_timesteps

    def learn(self, rounds: int) -> Episodes:
        """Run whole episodes in all environments, and learn meanwhile.

        Args:
            rounds: Number of episodes in each environment.

        Returns:
            These episodes, which are in the buffer.
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
        """The actor's average as it is now, without torch, its most likely action squashed."""
        weights = {name: value.numpy().copy() for name, value in self._sac.averaged.items()}
        layers = exported_layers(weights, self._layer_names)
        return MlpPolicy(AS_OBSERVED, layers, weights["log_std.bias"], "relu", squashed=True)

    @property
    def _layer_names(self) -> list[str]:
        return [*hidden_layers("latent_pi", len(self.settings.net_arch)), "mu"]

    def begin_with(self, policy: MlpPolicy, settings: WarmStartSettings) -> None:
        """Begin with the layers of another skill's policy; its noise is not taken over.

        Args:
            policy: Policy of the other skill.
            settings: Settings of the warm start: how the policy is kept from being destroyed.

        Raises:
            InvalidParameterError: It has other layers.
        """
        now = self._sac.actor.state_dict()
        names = self._layer_names
        shapes = [tuple(now[f"{name}.weight"].shape) for name in names]
        if [layer.shape for layer, _ in policy.layers] != shapes:
            given = [layer.shape for layer, _ in policy.layers]
            raise InvalidParameterError(
                f"a policy with layers {given} cannot start one with layers {shapes}; "
                "learn with the same hidden layers"
            )
        for name, (weight, bias) in zip(names, policy.layers, strict=True):
            for tensors in (now, self._sac.averaged):
                tensors[f"{name}.weight"].copy_(torch.from_numpy(weight))
                tensors[f"{name}.bias"].copy_(torch.from_numpy(bias))
        self._sac.be_guided(Guide.of(policy, settings))

    # -- checkpoints ------------------------------------------------------------------------------

    def save(self, path: Path) -> None:
        """Write a checkpoint, episodes not included. One that is there stays until it is whole."""
        sac = self._sac
        assert sac.log_ent_coef is not None
        assert sac.ent_coef_optimizer is not None
        save_checkpoint(
            path,
            {
                "policy": sac.policy.state_dict(),
                "averaged": sac.averaged,
                "actor_optimizer": sac.actor.optimizer.state_dict(),
                "critic_optimizer": sac.critic.optimizer.state_dict(),
                "entropy_weight": sac.log_ent_coef.detach(),
                "entropy_optimizer": sac.ent_coef_optimizer.state_dict(),
                "steps": sac.num_timesteps,
                "torch_generator": torch.get_rng_state(),
                "buffer_generator": self.buffer.generator_state,
            },
        )

    def resume(self, path: Path, episodes: list[Episodes]) -> None:
        """Go on from a checkpoint.

        Args:
            path: Path of the checkpoint.
            episodes: Episodes that were run before the checkpoint, all of them in order.

        Raises:
            InvalidParameterError: It is damaged.
        """
        saved, sac = read_checkpoint(path), self._sac
        assert sac.log_ent_coef is not None
        assert sac.ent_coef_optimizer is not None
        sac.policy.load_state_dict(saved["policy"])
        for name, value in sac.averaged.items():
            value.copy_(saved["averaged"][name])
        sac.actor.optimizer.load_state_dict(saved["actor_optimizer"])
        sac.critic.optimizer.load_state_dict(saved["critic_optimizer"])
        with torch.no_grad():
            sac.log_ent_coef.copy_(saved["entropy_weight"])
        sac.ent_coef_optimizer.load_state_dict(saved["entropy_optimizer"])
        sac.num_timesteps = saved["steps"]
        for some in episodes:
            self.buffer.add_episodes(some)
        self.buffer.generator_state = saved["buffer_generator"]
        torch.set_rng_state(saved["torch_generator"])


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what :meth:`SkillLearner.save` wrote.

    Raises:
        InvalidParameterError: It is damaged.
    """
    return load_checkpoint(path, _restored, "remove its folder to learn this skill again")


def _restored(saved: Mapping[str, Any]) -> dict[str, Any]:
    """The checkpoint that :meth:`SkillLearner.save` wrote, with values of the right types."""
    return {**saved, "averaged": dict(saved["averaged"]), "steps": int(saved["steps"])}
