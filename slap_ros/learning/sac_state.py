# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of stable-baselines3's SAC, transitions aside, for checkpoints. Needs torch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stable_baselines3 import SAC


def sac_state(sac: SAC) -> dict[str, Any]:
    """Networks, optimisers and the weight of entropy, as tensors, and the number of actions."""
    assert sac.ent_coef_optimizer is not None
    assert sac.log_ent_coef is not None
    return {
        "policy": sac.policy.state_dict(),
        "actor_optimizer": sac.actor.optimizer.state_dict(),
        "critic_optimizer": sac.critic.optimizer.state_dict(),
        "log_ent_coef": sac.log_ent_coef.detach(),
        "ent_coef_optimizer": sac.ent_coef_optimizer.state_dict(),
        "actions": sac.num_timesteps,
    }


def restore_sac(sac: SAC, saved: Mapping[str, Any]) -> None:
    """Take back what :func:`sac_state` gave; it may raise any error."""
    assert sac.ent_coef_optimizer is not None
    assert sac.log_ent_coef is not None
    sac.policy.load_state_dict(saved["policy"])
    sac.actor.optimizer.load_state_dict(saved["actor_optimizer"])
    sac.critic.optimizer.load_state_dict(saved["critic_optimizer"])
    sac.log_ent_coef.data.copy_(saved["log_ent_coef"])
    sac.ent_coef_optimizer.load_state_dict(saved["ent_coef_optimizer"])
    sac.num_timesteps = int(saved["actions"])
