# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proximal policy optimisation of one shortcut, by stable-baselines3. Needs torch."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecEnv

from slap_ros.errors import InvalidParameterError
from slap_ros.shortcuts.policy import Normalisation, Policy
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.practice import Episodes

RECENT = 200  # episodes over which success and length are taken


@dataclass(frozen=True)
class Progress:
    """How training goes, over recent episodes."""

    steps: int
    episodes: int
    success: float
    length: float  # of successful episodes; NaN where there is none
    lost: float
    shortest: int  # success so far; the horizon where there is none


class _Adapter(VecEnv):
    """Practice as stable-baselines3 wants it."""

    def __init__(self, practice: Episodes, normalisation: Normalisation) -> None:
        self.practice, self.normalisation = practice, normalisation
        self.history: deque[tuple[bool, int, bool]] = deque(maxlen=RECENT)
        self.episodes = 0
        self.shortest = practice.horizon
        size = practice.observations.shape[1]
        super().__init__(
            practice.episodes,
            gym.spaces.Box(-np.inf, np.inf, (size,), np.float32),
            gym.spaces.Box(-1.0, 1.0, (practice.actions.size,), np.float32),
        )

    def reset(self) -> Any:
        return self.normalisation(self.practice.observations)

    def step_async(self, actions: Any) -> None:
        self._actions = actions

    def step_wait(self) -> Any:
        steps = self.practice.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        last = self.normalisation(steps.last)
        for i in np.flatnonzero(steps.ended):
            infos[i]["terminal_observation"] = last[i]
            infos[i]["TimeLimit.truncated"] = bool(steps.late[i])
            self.history.append((bool(steps.done[i]), int(steps.lengths[i]), bool(steps.lost[i])))
            self.episodes += 1
            if steps.done[i]:
                self.shortest = min(self.shortest, int(steps.lengths[i]))
        observations = self.normalisation(steps.observations)
        return observations, steps.rewards.astype(np.float32), steps.ended, infos

    def progress(self, steps: int) -> Progress:
        lengths = [length for done, length, _ in self.history if done]
        count = max(len(self.history), 1)
        return Progress(
            steps,
            self.episodes,
            len(lengths) / count,
            float(np.mean(lengths)) if lengths else float("nan"),
            sum(lost for _, _, lost in self.history) / count,
            self.shortest,
        )

    def close(self) -> None:
        return None

    def get_attr(self, attr_name: str, _: Any = None) -> list[Any]:
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, *_: Any) -> None:
        raise NotImplementedError(f"practice has no attribute {attr_name} to be set")

    def env_method(self, method_name: str, *_: Any, **__: Any) -> list[Any]:
        raise NotImplementedError(f"practice has no method {method_name}")

    def env_is_wrapped(self, *_: Any) -> list[bool]:
        return [False] * self.num_envs


class _Watch(BaseCallback):
    """Tells how it goes after each rollout, and stops when told to."""

    def __init__(self, adapter: _Adapter, report: Callable[[Progress], bool]) -> None:
        super().__init__()
        self._adapter, self._report, self._go_on = adapter, report, True

    def _on_rollout_end(self) -> None:
        self._go_on = self._report(self._adapter.progress(self.num_timesteps))

    def _on_step(self) -> bool:
        return self._go_on


def normalisation_of(practice: Episodes, rng: np.random.Generator, steps: int) -> Normalisation:
    """From what random actions, each held for a while, let a policy see."""
    seen = []
    for step in range(steps):
        if step % 8 == 0:
            actions = rng.uniform(-1.0, 1.0, (practice.episodes, practice.actions.size))
        seen.append(practice.step(actions).observations)
    return Normalisation.of(np.concatenate(seen))


class Learner:
    """PPO on one shortcut's practice."""

    def __init__(
        self, practice: Episodes, normalisation: Normalisation, settings: PpoSettings, seed: int
    ) -> None:
        torch.set_num_threads(1)  # tiny networks: more threads only wait for one another
        self.settings = settings
        self._adapter = _Adapter(practice, normalisation)
        self._ppo = PPO(
            "MlpPolicy",
            self._adapter,
            n_steps=settings.rollout_steps,
            batch_size=settings.batch_size,
            n_epochs=settings.epochs,
            learning_rate=self._rate,
            gamma=settings.discount,
            gae_lambda=settings.gae_lambda,
            ent_coef=settings.entropy,
            policy_kwargs={
                "net_arch": list(settings.hidden),
                "activation_fn": torch.nn.Tanh,
                "log_std_init": settings.log_std,
            },
            seed=seed,
            device="cpu",
        )

    def _rate(self, remaining: float) -> float:
        rate = self.settings.learning_rate
        return rate * max(0.05, remaining) if self.settings.anneal else rate

    def learn(self, report: Callable[[Progress], bool], logs: Path | None = None) -> None:
        """Train until the steps are used up or ``report`` answers no.

        Args:
            report: Called after each rollout.
            logs: Folder for TensorBoard.
        """
        if logs is not None:
            self._ppo.set_logger(configure(str(logs), ["tensorboard"]))
        watch = _Watch(self._adapter, report)
        steps = self.settings.total_steps - self._ppo.num_timesteps
        if steps > 0:
            self._ppo.learn(steps, callback=watch, reset_num_timesteps=False)

    def policy(self) -> Policy:
        """What was learned so far."""
        weights = {k: v.detach().cpu().numpy().copy() for k, v in self._weights().items()}
        hidden = [f"mlp_extractor.policy_net.{2 * i}" for i in range(len(self.settings.hidden))]
        layers = tuple(
            (weights[f"{name}.weight"], weights[f"{name}.bias"]) for name in [*hidden, "action_net"]
        )
        return Policy(self._adapter.normalisation, layers, weights["log_std"])

    def _weights(self) -> dict[str, torch.Tensor]:
        return dict(self._ppo.policy.state_dict())

    @property
    def shortest(self) -> int:
        """Steps of the shortest success."""
        return self._adapter.shortest

    def inherit(self, earlier: Learner) -> None:
        """Begin with what an earlier learner knows, but with this one's noise."""
        weights = earlier._weights()
        weights["log_std"] = torch.full_like(weights["log_std"], self.settings.log_std)
        self._ppo.policy.load_state_dict(weights)
        self._adapter.shortest = earlier._adapter.shortest

    def save(self, path: Path) -> None:
        """A checkpoint to go on from; there always is a whole one."""
        draft = path.with_suffix(".draft")
        torch.save(
            {
                "steps": self._ppo.num_timesteps,
                "shortest": self._adapter.shortest,
                "policy": self._ppo.policy.state_dict(),
                "optimizer": self._ppo.policy.optimizer.state_dict(),
            },
            draft,
        )
        draft.rename(path)

    def resume(self, path: Path) -> None:
        """Go on from a checkpoint. Episodes begin anew."""
        saved = read_checkpoint(path)
        self._ppo.policy.load_state_dict(saved["policy"])
        self._ppo.policy.optimizer.load_state_dict(saved["optimizer"])
        self._ppo.num_timesteps = saved["steps"]
        self._adapter.shortest = saved["shortest"]


def read_checkpoint(path: Path) -> dict[str, Any]:
    """What :meth:`Learner.save` wrote. Only tensors and plain data are read, never code.

    Raises:
        InvalidParameterError: It is damaged.
    """
    try:
        saved = torch.load(path, weights_only=True)
        steps, shortest = int(saved["steps"]), int(saved["shortest"])
        return {
            "steps": steps,
            "shortest": shortest,
            "policy": dict(saved["policy"]),
            "optimizer": dict(saved["optimizer"]),
        }
    except Exception as error:  # torch says in a dozen ways that a file is damaged
        raise InvalidParameterError(
            f"{path}: damaged: {type(error).__name__}; remove it to learn this stage anew"
        ) from error
