# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How shortcuts are trained here: with few steps, as each takes some milliseconds."""

from __future__ import annotations

from slap_ros.core.learner_interface import SettingValue

TRAINING: dict[str, SettingValue] = {
    "exploration.tasks": 3,
    "exploration.rollouts": 24,
    "exploration.length": 48,
    "exploration.nodes": 2,  # the start, and with the target in the hand
    "ppo.total_steps": 60_000,
    "polish.n_steps": 64,
    "polish.total_steps": 40_000,
    "horizon": 60,
    "starts": 100,
    "shortcuts": 1,
}
