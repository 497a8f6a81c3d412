# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The top level where abstract states are many: fewer of them, and the same ways to the goal."""

from functools import partial

import pytest

from slap_ros.domains import get_domain
from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning import abstract_graph
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.graph_beyond import EdgeBeyond, add_beyond
from slap_ros.planning.hmax import HMaxHeuristic
from slap_ros.planning.problem import Problem
from slap_ros.relational import GroundOperator, LiftedOperator


def top_level(blocks, seed=0):
    """What builds the graph of a tower: start, goal, operators."""
    domain = get_domain("obstacle_tower", f"fair:obstacles={blocks}")
    task = domain.task(seed)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    start, goal = space.abstract(task.initial_state), space.mask(task.goal)
    return start, goal, problem.operators


def on_shortest_ways(graph):
    """Nodes from which a goal node is reached by as few operators as there are layers left."""
    on_way = set(graph.goal_nodes)
    for edge in reversed(graph.edges):
        deeper = graph.depth[edge.target] == graph.depth[edge.source] + 1
        if deeper and edge.target in on_way:
            on_way.add(edge.source)
    return {graph.nodes[i] for i in on_way}


def goals(graph):
    """Abstract states in which the goal holds, and how deep they are."""
    return {(graph.nodes[i], graph.depth[i]) for i in graph.goal_nodes}


@pytest.mark.parametrize("extra_depth", [0, 1])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_left_out_is_on_no_shortest_way(seed, extra_depth, monkeypatch):
    start, goal, operators = top_level(3, seed)
    whole = build_abstract_graph(start, goal, operators, extra_depth)
    monkeypatch.setattr(abstract_graph, "MANY_NODES", 10)
    part = build_abstract_graph(start, goal, operators, extra_depth)
    assert set(part.nodes) < set(whole.nodes)
    assert goals(part) == goals(whole)
    assert on_shortest_ways(part) == on_shortest_ways(whole)


def test_the_distance_is_never_more_than_the_operators_left():
    start, goal, operators = top_level(3)
    graph = build_abstract_graph(start, goal, operators)
    distance = HMaxHeuristic(goal, [operator for operator, _ in operators])
    depth = dict(zip(graph.nodes, graph.depth, strict=True))
    for node in on_shortest_ways(graph):
        assert distance(node) <= max(graph.depth) - depth[node]
    assert distance(start) > 1


def test_five_obstacles_take_no_more_abstract_states_than_needed():
    start, goal, operators = top_level(5)
    with pytest.raises(PlanningLimitError):
        build_abstract_graph(start, goal, operators, max_nodes=abstract_graph.MANY_NODES)
    graph = build_abstract_graph(start, goal, operators)
    assert max(graph.depth) == 12  # five times off and down, then the target block
    assert len(graph.nodes) < abstract_graph.MANY_NODES


def test_the_unreachable_stays_unsolvable_and_the_limit_is_kept(monkeypatch):
    start, goal, operators = top_level(2)
    monkeypatch.setattr(abstract_graph, "MANY_NODES", 10)
    with pytest.raises(PlanningLimitError, match="more than 20 abstract states"):
        build_abstract_graph(start, goal, operators, max_nodes=20)
    picks = [(o, option) for o, option in operators if "Place" not in str(o)]
    with pytest.raises(UnsolvableError, match="none of the"):
        build_abstract_graph(start, goal, picks)


# -- beyond the graph ------------------------------------------------------------------------------


def bits(*numbers):
    return sum(1 << i for i in numbers)


def operator(name, pre, add, delete):
    lifted = LiftedOperator(name, (), frozenset(), frozenset(), frozenset())
    return GroundOperator(lifted, (), bits(*pre), bits(*add), bits(*delete)), name


# Counting up: one atom after the other, each deletes the one before. The goal is atom 3.
COUNTING = [operator(f"to{i + 1}", [i], [i + 1], [i]) for i in range(6)]
DOWN = operator("from6", [6], [3], [6])


def counted(*beyond, operators=(*COUNTING, DOWN), **more):
    graph = build_abstract_graph(bits(0), bits(3), operators)
    before = list(graph.nodes), list(graph.depth), list(graph.edges)
    edges = [EdgeBeyond(source, state, partial(str, name)) for source, state, name in beyond]
    add_beyond(graph, edges, operators, **more)
    count = len(before[0])
    assert (graph.nodes[:count], graph.depth[:count]) == before[:2]  # nothing of it changes
    assert graph.edges[: len(before[2])] == before[2]
    added = [(e.source, e.target, e.option) for e in graph.edges[len(before[2]) :]]
    return graph.nodes[count:], graph.depth[count:], added


def test_a_goal_beyond_the_graph_is_added():
    further = bits(3, 9)
    assert counted((0, further, "leap")) == ([further], [1], [(0, 4, "leap")])


def test_operators_lead_on_from_beyond_the_graph():
    away = bits(6)
    back = [*COUNTING, operator("from6", [6], [3, 9], [6])]
    nodes, depth, edges = counted((0, away, "leap"), operators=back)
    assert nodes == [away, bits(3, 9)]
    assert depth == [1, 2]
    assert edges == [(0, 4, "leap"), (4, 5, "from6")]


def test_a_goal_that_is_there_already_is_a_node_once_more():
    """No edge leads back, so that paths are finite; and a way to it is not lost."""
    away, other = bits(6), bits(6, 9)
    assert counted((0, away, "leap")) == (
        [away, bits(3)],
        [1, 2],
        [(0, 4, "leap"), (4, 5, "from6")],
    )
    both = [*COUNTING, DOWN, operator("from69", [6, 9], [3], [6, 9])]
    nodes, _, edges = counted((0, away, "leap"), (0, other, "jump"), operators=both)
    assert nodes.count(bits(3)) == 1  # once for all ways
    assert {name for _, target, name in edges if nodes[target - 4] == bits(3)} == {
        "from6",
        "from69",
    }


def test_what_comes_back_to_the_graph_leads_on_from_there():
    """What is done beyond may be something that operators do later, in another order."""
    back = [*COUNTING, operator("from6", [6], [2], [6])]
    nodes, depth, edges = counted((0, bits(6), "leap"), operators=back)
    assert nodes == [bits(6), bits(2), bits(3)]
    assert depth == [1, 2, 3]
    assert edges == [(0, 4, "leap"), (4, 5, "from6"), (5, 6, "to3")]
    # By more edges than the operators' own, it is of no use.
    assert counted((1, bits(6), "leap"), operators=back)[0] == []


def test_no_path_beyond_has_more_edges_than_the_graph_is_deep():
    back = [*COUNTING, operator("from6", [6], [3, 9], [6])]
    assert counted((1, bits(6), "leap"), operators=back)[0] == [bits(6), bits(3, 9)]
    assert counted((2, bits(6), "leap"), operators=back)[0] == []
    assert counted((2, bits(3, 9), "leap"))[0] == [bits(3, 9)]
    assert counted((3, bits(3, 9), "leap"))[0] == []  # a goal is the end of a plan


def test_what_leads_to_no_goal_is_left_out():
    assert counted((0, bits(8), "in vain"), (0, bits(3, 9), "leap"))[0] == [bits(3, 9)]


def test_no_more_is_added_than_there_may_be():
    two = (0, bits(3, 8), "one"), (0, bits(3, 9), "other")
    assert counted(*two, max_nodes=5)[0] == [bits(3, 8)]
    assert counted(*two, max_nodes=6)[0] == [bits(3, 8), bits(3, 9)]
