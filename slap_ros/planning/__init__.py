# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract planning graph, search, and closed-loop execution.

Read on in this order: ``options``, ``option_execution``, ``abstract_graph``, ``model``, ``search``,
``problem``, ``graph_planner``, ``recovery``, ``planner``, ``execution``.
"""
