# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings with which a shortcut is found and learned in the domain `points`, in seconds."""

SMALL = [
    "polish=none", "ppo.total_steps=6144", "starts=24", "validation=3", "shortcuts=1",
    "exploration.tasks=3", "exploration.nodes=1", "exploration.rollouts=128",
    "exploration.action_repeat=3", "exploration.length=20",
]  # fmt: skip
