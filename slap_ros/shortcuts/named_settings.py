# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of training by name: ours, variants of ours, the paper's, and a domain's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from slap_ros.core import Domain, SettingValue
from slap_ros.errors import InvalidDomainError, InvalidParameterError
from slap_ros.learning.setting_changes import changed
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.rewards import Rewards
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings
from slap_ros.shortcuts.sampling import PAPER
from slap_ros.shortcuts.settings import OURS, TrainingSettings
from slap_ros.shortcuts.stopping import Stopping

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
