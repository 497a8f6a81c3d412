# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What domains of a hand with contact forces at a table have in common.

Read on in this order: ``features`` (types), ``state_access``, ``metrics``, ``predicates``,
``operators``, ``goals``, ``tasks`` (where things are drawn); then what moves: ``hand_motion``,
``scripts``, ``approach``; then ``learner_interface``, and ``presets``, which puts a domain
together.
``stack_at_target`` is the smallest domain that is made of all this.
"""
