# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Python API: the few functions that ``import slap_ros`` gives.

Each is in a file of its own, and the command line calls the same ones. What they return are the
core's own objects: a :class:`~slap_ros.core.Domain`, a :class:`~slap_ros.core.Task`, a
:class:`~slap_ros.planning.plan.PlanningResult`. Read ``opening.py``, ``planning.py`` and
``execution.py`` first.
"""
