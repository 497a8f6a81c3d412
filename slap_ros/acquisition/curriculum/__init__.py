# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The automatic curriculum: which skills are learned, when and from which states (LG-SAIL Alg. 1).

Read on in this order: ``curriculum``, ``rollouts``, ``skill_selection``, ``jobs``.
"""
