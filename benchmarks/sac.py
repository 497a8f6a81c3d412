# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an update of SAC costs, beside stable-baselines3's in the same process.

    python -m benchmarks.sac [--updates 400]

CPU time, on one thread, variants in turn so that they meet the same load. The environment costs
nothing here; ``benchmarks.skill_learning`` measures the whole loop.
"""

from __future__ import annotations

import argparse
from statistics import median
from time import process_time
from typing import Any, TypeVar

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger

from slap_ros.acquisition.training.sac_settings import SMALL
from slap_ros.acquisition.training.sac_update import LeanSac
from slap_ros.skills.observations import SIZE

ACTIONS = 5  # x, y, z, yaw, gripper
ROUNDS = 8

Learner = TypeVar("Learner", bound=SAC)


class Noise(gym.Env[Any, Any]):
    """Random observations of a skill's size."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (SIZE,), np.float32)
    action_space = gym.spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)

    def __init__(self) -> None:
        self._rng = np.random.default_rng(0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """The first observation of an episode."""
        del seed, options
        return self._observe(), {}

    def step(self, action: Any) -> Any:
        """Another observation, whatever is done."""
        del action
        return self._observe(), 0.1, False, False, {}

    def _observe(self) -> Any:
        return self._rng.uniform(-1.0, 1.0, SIZE).astype(np.float32)


def make(kind: type[Learner], **settings: Any) -> Learner:
    """A learner with a full buffer."""
    learner = kind(
        "MlpPolicy", Noise(), learning_starts=600, buffer_size=600, seed=0, device="cpu", **settings
    )
    learner.learn(600)
    learner.set_logger(Logger(None, []))
    return learner


def main() -> None:
    """Print CPU milliseconds of an update, and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--updates", type=int, default=400)
    updates = parser.parse_args().updates // ROUNDS
    torch.set_num_threads(1)
    same = {"batch_size": SMALL.batch_size, "policy_kwargs": {"net_arch": list(SMALL.net_arch)}}
    fused = {
        "batch_size": SMALL.batch_size,
        "policy_kwargs": {"net_arch": list(SMALL.net_arch), "optimizer_kwargs": {"fused": True}},
    }
    as_skills_learn = make(LeanSac, **fused)
    as_skills_learn.normalise_critics()
    learners: dict[str, SAC] = {
        "stable-baselines3, its defaults ([256, 256], batch 256)": make(SAC),
        "stable-baselines3, our sizes ([64, 64], batch 128)": make(SAC, **same),
        "ours ([64, 64], batch 128)": make(LeanSac, **fused),
        "ours, layers of the critics normalised, as skills learn": as_skills_learn,
    }
    times: dict[str, list[float]] = {name: [] for name in learners}
    for _ in range(ROUNDS):
        for name, learner in learners.items():
            began = process_time()
            learner.train(updates, batch_size=learner.batch_size)
            times[name].append((process_time() - began) / updates * 1e3)
    *_, ours = (median(each) for each in times.values())
    for name, each in times.items():
        print(f"{name}: {median(each):.2f} ms; ours is {ours / median(each):.2f} of it")


if __name__ == "__main__":
    main()
