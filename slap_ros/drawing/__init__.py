# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of plans, as SVG text."""

from slap_ros.drawing.abstract_graph import draw_abstract_graph

__all__ = ["draw_abstract_graph"]
