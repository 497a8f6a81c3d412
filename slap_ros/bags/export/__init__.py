# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags in the formats of other tools: numpy archives, tables, data sets for LeRobot.

Read ``formats.py`` first, then ``episode_table.py``, which the tables share.
"""

from slap_ros.bags.export.formats import choose_format, export_episodes, require_exportable

__all__ = ["choose_format", "export_episodes", "require_exportable"]
