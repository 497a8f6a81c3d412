# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills that run, without torch: acquired ones, scripts, and which domain has which skills.

Read on in this order: ``domain_choice``, ``skill``, ``groundings``, ``observations``, ``reward``,
``skill_library``.
"""
