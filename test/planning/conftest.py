# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What tests of planning share."""

import pytest

from slap_ros.errors import PlanningLimitError
from slap_ros.planning import anytime
from slap_ros.planning.graph_planner import GraphPlanner


@pytest.fixture
def too_large(monkeypatch):
    """Any graph is too large for the anytime planner, and it has all of its effort."""
    whole = anytime.GraphPlanner.graph

    def none(planner, *arguments):
        if planner.max_nodes == GraphPlanner(planner.problem).max_nodes:
            return whole(planner, *arguments)
        raise PlanningLimitError("too large")

    monkeypatch.setattr(anytime.GraphPlanner, "graph", none)
