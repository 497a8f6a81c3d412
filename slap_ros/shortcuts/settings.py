# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every hyper-parameter of shortcut learning by name; ours, and the paper's (SLAP, appendix)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

from slap_ros.core import Domain, SettingValue
from slap_ros.errors import InvalidDomainError, InvalidParameterError
from slap_ros.learning.setting_changes import changed
from slap_ros.learning.stored_keys import restored, stored
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings
from slap_ros.shortcuts.sampling import DEFAULT, PAPER, Sampling
from slap_ros.shortcuts.stopping import Stopping

OTHER_WAYS = (
    "also_repeat",
    "pushes",
    "inside",
    "beyond",
    "budget",
    "straightened",
    "regrasps",
    "along_plan",
    "approaches",
)  # settings of exploration that work folders lack where they are off


@dataclass(frozen=True)
class ExplorationSettings:
    """Collecting states and pruning candidates (SLAP §4.2, B.1).

    Args:
        tasks: Number of tasks that are explored.
        rollouts: Number of random rollouts from each recorded state (N_rollout).
        length: Environment steps of each rollout at most (T_rollout).
        hits: Number of rollouts that must reach a pair of abstract states, which else is pruned
            (K_rollout).
        action_repeat: Environment steps for which a random action is repeated: 1 jitters on the
            spot.
        nodes: Number of abstract states explored in a task, the cheapest to reach first.
        also_repeat: Environment steps for which a random action is repeated in as many rollouts
            again; 0 for no such rollouts.
        pushes: Number of batches of straight pushes from each state, at every object.
        inside: Environment steps between the states inside a skill's execution in which rollouts
            begin as well; 0 for none.
        beyond: Whether abstract states count that operators reach in no plan.
        budget: Environment steps of a task; no rollouts are begun that could take more. 0 for no
            such limit.
        straightened: Number of stretches that are tried to make the execution of two skills, one
            after the other, shorter (:mod:`slap_ros.shortcuts.straightening`); 0 for no such
            executions.
        regrasps: Whether two skills also show what leaves the hand as it was, though they take or
            release something on the way. Its policy has the gripper then.
        along_plan: Whether the first of two skills may also begin wherever the plan leads.
        approaches: Number of batches of straight pushes from where each approach of an object ends
            (:mod:`slap_ros.shortcuts.approaches`); 0 for no approaches.
    """

    tasks: int = 4
    rollouts: int = 48
    length: int = 60
    hits: int = 1
    action_repeat: int = 8
    nodes: int = 6
    also_repeat: int = 0
    pushes: int = 0
    inside: int = 0
    beyond: bool = False
    budget: int = 0
    straightened: int = 0
    regrasps: bool = False
    along_plan: bool = False
    approaches: int = 0

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`.

        What else there is than random rollouts from where skills end, and a budget, is left out
        where there is none, as work folders have it from when there was no other way.
        """
        data = stored(self)
        return {name: value for name, value in data.items() if value or name not in OTHER_WAYS}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ExplorationSettings:
        """The settings of :meth:`as_json`.

        Raises:
            TypeError: A key is not a setting.
        """
        return cls(**restored(cls, data))


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
    def most_steps(self) -> int:
        """Environment steps that a shortcut takes if its first stage is learned in all attempts.

        A stage ends with the rollout in which its steps are reached.
        """
        each = [
            ceil(stage.total_steps / stage.rollout_steps) * stage.rollout_steps
            for stage in self.stages
        ]
        showing = 0
        if self.cloning is not None:  # each try ends with the horizon at the latest, as a rule
            showing = self.starts * (self.cloning.straightened + 2) * self.horizon
        return showing + sum(each) + (self.attempts - 1) * each[0]

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
_PAPER_PPO = PpoSettings(
    n_envs=1,
    n_steps=100,
    batch_size=16,
    learning_rate=3e-4,
    anneal=False,
    gamma=0.99,
    gae_lambda=0.95,
    ent_coef=0.01,
    log_std_init=0.0,
)
# The paper says -1 per step; its code adds 100 for success, and 0.5 and 10 in Obstacle 2D.
_PAPER = replace(
    OURS,
    exploration=ExplorationSettings(rollouts=100, length=300, hits=5, action_repeat=1, nodes=1000),
    polish=None,
    ppo=replace(_PAPER_PPO, total_steps=300_000),
    rewards=Rewards(step=-1.0, success=100.0, failure=0.0, shaping=0.0, gamma=0.99, scale=1.0),
    horizon=100,
    sampling=PAPER,
)
SEVERAL = "ours_several"  # settings for several shortcuts, which serve different tasks and goals
_SEVERAL: Mapping[str, SettingValue] = {
    "exploration.tasks": 24,
    "random_goals": 0.5,
    "least_saving": 0.005,
    "validation": 48,  # over fewer tasks, a small saving does not show
    "shortcuts": 8,
}
SHORT = "ours_short"  # settings that end learning as soon as plans get no shorter
_SHORT: Mapping[str, SettingValue] = {"stopping.every": Stopping().every}
NEAR = "ours_near"  # settings that explore near objects, and beyond what operators reach
_NEAR: Mapping[str, SettingValue] = {
    "exploration.rollouts": 16,
    "exploration.also_repeat": 4,
    "exploration.pushes": 1,
    "exploration.inside": 8,
    "exploration.beyond": True,
}
CHAINS = "ours_chains"  # settings that clone executions of two skills, made shorter
_CHAINS: Mapping[str, SettingValue] = {
    "exploration.rollouts": 1,
    "exploration.straightened": 40,
    "cloning.straightened": ShortcutCloningSettings().straightened,
    "starts": 200,
    "horizon": 60,
}
APPROACHES = "ours_approaches"  # settings that clone approaches with pushes, made shorter
_APPROACHES: Mapping[str, SettingValue] = {
    "exploration.rollouts": 1,
    "exploration.length": 25,
    "exploration.approaches": 1,
    "exploration.beyond": True,
    "cloning.straightened": 30,  # what was cut more closely fails more often
    "cloning.disturbed": 4,
    "cloning.epochs": 40,
    "starts": 200,
    "horizon": 60,
}
KEPT_CHAINS = "ours_kept_chains"  # the same of skills and of shortcuts that a training keeps
_KEPT_CHAINS: Mapping[str, SettingValue] = {
    **_CHAINS,
    "exploration.regrasps": True,
    "exploration.along_plan": True,
    "cloning.disturbed": 4,
    "cloning.epochs": 40,
    "starts": 400,
    "shortcuts": 2,
}
SUBGOALS = "subgoals"  # settings that learn one policy for several shortcuts
_SUBGOALS: Mapping[str, SettingValue] = {"together": 4, "attempts": 1}
SAC = "sac"  # settings that learn with SAC in the place of PPO
_SAC: Mapping[str, SettingValue] = {"sac.gamma": ShortcutSacSettings().gamma}
ABSTRACT_HER = "abstract_her"  # one policy of SAC for several shortcuts, and their targets in turn
_ABSTRACT_HER: Mapping[str, SettingValue] = {
    **_SUBGOALS,
    "sac.buffer_size": 1_000,
    "sac.hindsight": 0.95,
}
_VARIANTS = {
    SEVERAL: _SEVERAL,
    SHORT: _SHORT,
    APPROACHES: _APPROACHES,
    NEAR: _NEAR,
    CHAINS: _CHAINS,
    KEPT_CHAINS: _KEPT_CHAINS,
    SUBGOALS: _SUBGOALS,
    SAC: _SAC,
    ABSTRACT_HER: _ABSTRACT_HER,
}  # of a domain's "ours"
GENERAL: Mapping[str, TrainingSettings] = {
    "ours": OURS,
    **{name: changed(OURS, changes) for name, changes in _VARIANTS.items()},
    "paper": _PAPER,
}


def training_settings(name: str, domain: Domain) -> TrainingSettings:
    """Settings by name, as they are in a domain.

    Args:
        name: Name of the settings: one of ``GENERAL``, or of the domain's own, which differ from
            the general ``ours``.
        domain: Domain whose ``Learning.settings`` give the differences. For variants of ``ours``,
            its ``ours`` do too.

    Raises:
        InvalidParameterError: There are none of that name.
        InvalidDomainError: The domain changes settings that there are not, or as they cannot be.
    """
    own = {} if domain.learning is None else domain.learning.settings
    if name not in GENERAL and name not in own:
        known = ", ".join(dict.fromkeys([*GENERAL, *own]))
        raise InvalidParameterError(f"unknown settings {name!r}; there are {known}")
    base, changes = GENERAL.get(name, OURS), own.get(name, {})
    if name in _VARIANTS:
        base, changes = training_settings("ours", domain), {**_VARIANTS[name], **changes}
    try:
        return changed(base, changes)
    except InvalidParameterError as error:
        raise InvalidDomainError(
            f"domain {domain.name}, Learning.settings[{name!r}]: {error}"
        ) from error
