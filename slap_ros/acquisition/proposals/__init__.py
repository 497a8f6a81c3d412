# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators and rewards that are proposed and checked (LG-SAIL §4.1, §4.2).

Read on in this order: ``problem``, ``proposal``, ``verification``, ``proposers``, ``induction``,
``language_proposer``.
"""
