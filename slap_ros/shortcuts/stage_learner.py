# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who learns a stage, by its settings: PPO, SAC or cloning. Needs torch."""

from __future__ import annotations

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.vec_env import VecEnv
from slap_ros.policies.mlp_policy import ObservationNormalisation
from slap_ros.shortcuts.cloning import CloningLearner
from slap_ros.shortcuts.cloning_settings import ShortcutCloningSettings
from slap_ros.shortcuts.demonstrations import Demonstrated
from slap_ros.shortcuts.ppo import Learner
from slap_ros.shortcuts.ppo_settings import PpoSettings
from slap_ros.shortcuts.sac import SacLearner
from slap_ros.shortcuts.settings import StageSettings

StageLearner = Learner | SacLearner | CloningLearner


def make_learner(
    env: VecEnv,
    normalisation: ObservationNormalisation,
    settings: StageSettings,
    seed: int,
    shown: Demonstrated | None = None,
) -> StageLearner:
    """A learner with random weights.

    Args:
        env: Environments of the shortcut.
        normalisation: Normalisation of observations.
        settings: Hyper-parameters of the stage.
        seed: Seed of weights and noise.
        shown: Steps of demonstrations, for cloning; None where there are none.

    Raises:
        InvalidParameterError: There is nothing to clone.
    """
    if isinstance(settings, PpoSettings):
        return Learner(env, normalisation, settings, seed)
    if not isinstance(settings, ShortcutCloningSettings):
        return SacLearner(env, normalisation, settings, seed)
    if shown is None:
        raise InvalidParameterError(
            "cloning learns a policy for each shortcut, from demonstrations of its own; leave "
            "`together` at 1"
        )
    return CloningLearner(env, normalisation, settings, seed, shown)
