# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every hyper-parameter of shortcut learning (SLAP, appendix)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.stored_keys import stored
from slap_ros.shortcuts.approaches import usual_steps_of_pushes
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.stopping import Stopping

StageSettings = PpoSettings | ShortcutSacSettings | ShortcutCloningSettings
ENOUGH_SUCCESS = 0.5  # share of the last episodes of the first stage: no further attempt
LEARN = PpoSettings(total_steps=250_000)
POLISH = PpoSettings(
    n_steps=128,
    batch_size=512,
    learning_rate=4e-4,
    gae_lambda=0.95,
    log_std_init=-1.3,
    total_steps=250_000,
)


@dataclass(frozen=True)
class TrainingSettings:
    """All hyper-parameters of a training.

    Args:
        exploration: Settings of how candidates are found.
        ppo: Settings of PPO in the first stage, which learns a shortcut.
        polish: Settings of PPO in the second stage, which makes the shortcut shorter, with less
            noise; None for no such stage.
        rewards: Rewards that the shortcut is learned from.
        polish_rewards: Rewards of the second stage; None for the same as in the first. A failure
            may cost more then, since those that noise still causes can be avoided.
        horizon: Environment steps after which an episode is truncated.
        starts: Number of tasks in which an initial state is looked for.
        shortcuts: Number of shortcuts that are trained at most, those with the largest expected
            saving first.
        least_saving: Share of a plan's length that a shortcut must be expected to save, and then
            save on validation tasks, to be kept.
        validation: Number of validation tasks.
        sampling: Settings of how shortcuts are tried out when planning.
        attempts: Number of times that the first stage is learned at most, each time with other
            random numbers, until ``ENOUGH_SUCCESS`` is reached. The most successful attempt is
            polished.
        random_goals: Share of the tasks for exploration and validation that have another goal than
            their own.
        stopping: Rule by which a stage of learning ends early; None to use all of its environment
            steps.
        sac: Settings of SAC, which learns in the place of PPO, in a single stage; None for PPO.
        together: Number of shortcuts that one policy learns (:mod:`slap_ros.shortcuts.subgoals`);
            1 for a policy each.
        budget: Environment steps of exploring and of learning all shortcuts together; no shortcut
            is begun that could take more. 0 for no such limit.
        cloning: Settings of cloning, which learns in the place of PPO, in a single stage, from
            straightened executions of skills; None for PPO.
    """

    exploration: ExplorationSettings = field(default_factory=ExplorationSettings)
    ppo: PpoSettings = LEARN
    polish: PpoSettings | None = POLISH
    rewards: Rewards = field(default_factory=Rewards)
    polish_rewards: Rewards | None = None
    horizon: int = 100
    starts: int = 300
    shortcuts: int = 4
    least_saving: float = 0.05
    validation: int = 8
    sampling: Sampling = DEFAULT
    attempts: int = 1
    random_goals: float = 0.0
    stopping: Stopping | None = None
    sac: ShortcutSacSettings | None = None
    together: int = 1
    budget: int = 0
    cloning: ShortcutCloningSettings | None = None

    @property
    def stages(self) -> tuple[StageSettings, ...]:
        """The learner's hyper-parameters, stage after stage."""
        if self.cloning is not None:
            return (self.cloning,)
        if self.sac is not None:
            return (self.sac,)
        return (self.ppo,) if self.polish is None else (self.ppo, self.polish)

    def rewards_in(self, stage: int) -> Rewards:
        """The rewards of a stage, with the discount of that stage."""
        rewards = self.rewards if stage == 0 or self.polish_rewards is None else self.polish_rewards
        return replace(rewards, gamma=self.stages[stage].gamma)

    @property
    def total_steps(self) -> int:
        """Environment steps that a shortcut is trained for, in all stages together."""
        return sum(stage.total_steps for stage in self.stages)

    @property
    def policy_steps(self) -> int:
        """Environment steps of a shortcut's policy if its first stage is learned in all attempts.

        A stage ends with the rollout in which its steps are reached.
        """
        each = [
            ceil(stage.total_steps / stage.rollout_steps) * stage.rollout_steps
            for stage in self.stages
        ]
        return sum(each) + (self.attempts - 1) * each[0]

    @property
    def steps_per_shortcut(self) -> int:
        """Environment steps that are left when a shortcut is begun, in which it can be learned.

        Demonstrations usually take no more than is counted here, and are as many as can be paid.
        """
        return self.policy_steps + self.starts * self._demonstration_steps

    @property
    def _demonstration_steps(self) -> int:
        """Environment steps that a demonstration usually takes.

        It takes half the horizon, and what follows a stretch half of that. It is executed once as
        it was found, and again to learn from it.
        """
        if self.cloning is None:
            return 0
        whole = 2 + self.cloning.repetitions  # found, executed, and made again
        executed = (self.cloning.straightened + 2 * whole) * self.horizon // 4
        if not self.exploration.approaches:
            return executed
        return executed + usual_steps_of_pushes(self.exploration.length)

    def with_total_steps(self, steps: int) -> TrainingSettings:
        """As many environment steps in all, shared among the stages as they are now.

        Raises:
            InvalidParameterError: Fewer steps than stages.
        """
        if steps < len(self.stages):
            raise InvalidParameterError(f"{len(self.stages)} stages cannot share {steps} steps")
        if self.cloning is not None:
            return replace(self, cloning=replace(self.cloning, total_steps=steps))
        if self.sac is not None:
            return replace(self, sac=replace(self.sac, total_steps=steps))
        if self.polish is None:
            return replace(self, ppo=replace(self.ppo, total_steps=steps))
        share = round(steps * self.ppo.total_steps / self.total_steps)
        first = min(max(share, 1), steps - 1)
        return replace(
            self,
            ppo=replace(self.ppo, total_steps=first),
            polish=replace(self.polish, total_steps=steps - first),
        )

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`.

        A single attempt, no other goals, no rule that ends learning, no SAC, a policy for each
        shortcut, no budget and no cloning are left out, as work folders have it from when there
        was no other way.
        """
        data = stored(self)
        optional = ("attempts", "random_goals", "stopping", "sac", "together", "budget", "cloning")
        for name in optional:
            if getattr(self, name) == getattr(OURS, name):
                del data[name]
        return data


OURS = TrainingSettings()
