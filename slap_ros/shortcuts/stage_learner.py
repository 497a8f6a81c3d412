# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who learns a stage, by its settings: PPO or SAC. Needs torch."""

from __future__ import annotations

from slap_ros.learning.vec_env import VecEnv
from slap_ros.policies.mlp_policy import ObservationNormalisation
from slap_ros.shortcuts.ppo import Learner
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.sac import SacLearner
from slap_ros.shortcuts.sac_settings import ShortcutSacSettings

StageLearner = Learner | SacLearner


def make_learner(
    env: VecEnv,
    normalisation: ObservationNormalisation,
    settings: PpoSettings | ShortcutSacSettings,
    seed: int,
) -> StageLearner:
    """A learner with random weights.

    Args:
        env: Environments of the shortcut.
        normalisation: Normalisation of observations.
        settings: Hyper-parameters of the stage.
        seed: Seed of weights and noise.
    """
    if isinstance(settings, PpoSettings):
        return Learner(env, normalisation, settings, seed)
    return SacLearner(env, normalisation, settings, seed)
