# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning one skill by reinforcement (LG-SAIL §4.3).

Read on in this order: ``skill_env``, ``sac``, ``skill_training``, ``validation``, ``warm_start``,
``guided_sac``.
"""
