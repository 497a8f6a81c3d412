# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SAC that chooses movements of the hand and their parameters, LG-SAIL's HRL. Needs torch.

MAPLE (Nasiriany et al. 2022), LG-SAIL §5: one policy for all of a task chooses a primitive (reach,
grasp, place, push, open, or one step of the joints) and where it acts, relative to what the present
operator of the task's plan acts on. Tasks, observations and reward are those of ``sac.py``; on top
there is MAPLE's affordance, by which a point costs the more the farther it is from the target.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from slap_ros.baselines import sac
from slap_ros.baselines.hybrid_sac import HybridSac
from slap_ros.baselines.method import Method
from slap_ros.baselines.sac import SacTaskLearner, StagedSacSettings
from slap_ros.baselines.scores import SCORE_NOISE
from slap_ros.baselines.training_envs import TrainingEnvs, separate_envs
from slap_ros.environments.controls import PrimitiveControl
from slap_ros.policies.mlp_policy import MlpPolicy

# Standard deviation of numbers with the entropy that SAC aims at, -1 each.
NUMBER_NOISE = math.exp(-1.0) / math.sqrt(2.0 * math.pi * math.e)
NEWEST = 1_000  # actions of each environment, of which a share is taken


class AffordanceRewards(VecEnvWrapper):
    """Environments in which a primitive costs the more the farther its point is from the target.

    A bonus for near points would be paid again and again, so that to go on would be better than to
    reach the goal. MAPLE's code takes it away from far ones, too.
    """

    def __init__(self, envs: VecEnv, control: PrimitiveControl, weight: float) -> None:
        """Add to the reward of the task.

        Args:
            envs: Environments of tasks.
            control: What their actions do.
            weight: What the farthest point costs.
        """
        super().__init__(envs)
        self._control, self._weight = control, weight

    def reset(self) -> Any:
        """See stable-baselines3."""
        return self.venv.reset()

    def step_async(self, actions: NDArray[Any]) -> None:
        """See stable-baselines3."""
        scores = [self._control.affordance(np.asarray(one, float)) for one in actions]
        self._costs = self._weight * (1.0 - np.array(scores, dtype=np.float32))
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """See stable-baselines3."""
        observations, rewards, dones, infos = self.venv.step_wait()
        return observations, rewards - self._costs, dones, infos


@dataclass(frozen=True)
class MapleSettings(StagedSacSettings):
    """Hyper-parameters: those of ``sac``, but for how much is learned from how many actions."""

    learning_starts: int = 100  # random actions, most of which take tens of environment steps
    gamma: float = 0.95  # of an action
    gradient_steps: int = 32
    affordance: float = 5.0  # what a point costs that is far away


class MapleLearner(SacTaskLearner):
    """SAC over primitives on the training tasks."""

    _joints_moved = 0.0  # share of the newest actions

    def __init__(self, settings: MapleSettings, envs: TrainingEnvs, seed: int) -> None:
        """Begin with random weights and no transitions.

        Args:
            settings: Hyper-parameters.
            envs: Environments of the training tasks, with primitives for actions.
            seed: Seed of weights and noise.
        """
        control = PrimitiveControl(envs.domain)
        super().__init__(
            settings,
            replace(
                envs, make=lambda: AffordanceRewards(envs.make(), control, settings.affordance)
            ),
            seed,
            DictReplayBuffer,
            kind=HybridSac,
            buffer_size=min(settings.buffer_size, settings.total_steps + settings.n_envs),
            learning_starts=settings.learning_starts,
        )
        self._choices = len(control.space.sizes)

    def policy(self) -> MlpPolicy:
        """The most likely actions, and noise by which others are chosen about as often as learned.

        Without noise, a movement that changes nothing is chosen for ever.
        """
        likely = super().policy()
        noise = np.full(len(likely.log_std), math.log(NUMBER_NOISE), np.float32)
        noise[: self._choices] = math.log(SCORE_NOISE)
        return replace(likely, log_std=noise)

    def figures(self) -> Mapping[str, float]:
        """How often joints are moved, as a share of the newest actions of all environments."""
        taken = self.buffer.actions[max(0, self.buffer.pos - NEWEST) : self.buffer.pos]
        if len(taken):
            chosen = taken[..., : self._choices].argmax(axis=-1)
            self._joints_moved = float(np.mean(chosen == 0))
        return {"joints_moved": self._joints_moved}


METHOD = Method(
    {**sac.METHOD.environment, "control": "primitives"},
    {"ours": MapleSettings()},
    MapleLearner,
    separate_envs,
)
