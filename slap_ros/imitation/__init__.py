# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills cloned from demonstrations: what acquired skills are compared with (LG-SAIL Table 7).

Read on in this order: ``trajectories`` (what is imitated), ``settings``, ``cloning`` (how),
``unchecked_plans`` (clones that carry out what a language model wrote).
"""
