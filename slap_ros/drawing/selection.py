# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What of an abstract graph and a plan goes into a picture."""

from __future__ import annotations

from dataclasses import dataclass

from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan import Plan, PlanEdge

MAX_NODES = 240  # more than anyone can look at; the plan's and the first discovered are kept


@dataclass(frozen=True)
class ShownNode:
    """An abstract state to be drawn."""

    number: int  # in order of discovery
    depth: int
    atoms: int  # mask
    is_goal: bool
    on_plan: bool


@dataclass(frozen=True)
class ShownEdge:
    """An edge to be drawn; ends are positions among the nodes shown."""

    source: int
    target: int
    option: Option
    is_forward: bool  # search may follow it
    step: int | None = None  # place in the plan, from 1
    predicted_steps: int | None = None  # environment steps, for the plan's edges

    @property
    def is_shortcut(self) -> bool:
        """Whether the edge's option was learned."""
        return self.option.kind is OptionKind.SHORTCUT

    @property
    def mark(self) -> str:
        """How the edge is to be drawn: as one of ``palette.PENS``."""
        if not self.is_forward:
            return "back"
        if self.step is None:
            return "other shortcut" if self.is_shortcut else "option"
        return "shortcut" if self.is_shortcut else "plan"


@dataclass(frozen=True)
class Selection:
    """Nodes and edges to be drawn."""

    nodes: tuple[ShownNode, ...]
    edges: tuple[ShownEdge, ...]
    hidden: int  # nodes left out


def select(graph: AbstractGraph, plan: Plan | None) -> Selection:
    """The graph's nodes and edges, with the plan's marked.

    A plan may leave the graph, as those of a greedy planner do: its own nodes and edges are
    added then.
    """
    atoms, depths = list(graph.nodes), list(graph.depth)
    path = _path(atoms, depths, plan)
    on_plan = {0} if plan is not None else set()
    on_plan |= {target for _, target, _ in path}
    kept = _kept(len(atoms), on_plan)
    place = {number: i for i, number in enumerate(kept)}
    nodes = tuple(
        ShownNode(
            number,
            depths[number],
            atoms[number],
            atoms[number] & graph.goal == graph.goal,
            number in on_plan,
        )
        for number in kept
    )
    edges = [
        ShownEdge(place[source], place[target], edge.option, True, step, edge.predicted_steps)
        for step, (source, target, edge) in enumerate(path, start=1)
    ]
    edges += _others(graph, place, {(s, t, edge.option) for s, t, edge in path})
    return Selection(nodes, tuple(edges), len(atoms) - len(kept))


def _path(
    atoms: list[int], depths: list[int], plan: Plan | None
) -> list[tuple[int, int, PlanEdge]]:
    """The plan's edges between node numbers; nodes that are not there yet are appended."""
    number = {mask: i for i, mask in enumerate(atoms)}
    path, source = [], 0
    for edge in plan.edges if plan is not None else ():
        expected = edge.target.required
        if expected not in number:
            number[expected] = len(atoms)
            atoms.append(expected)
            depths.append(depths[source] + 1)
        path.append((source, number[expected], edge))
        source = number[expected]
    return path


def _kept(count: int, on_plan: set[int]) -> list[int]:
    others = [number for number in range(count) if number not in on_plan]
    return sorted(on_plan | set(others[: max(0, MAX_NODES - len(on_plan))]))


def _others(
    graph: AbstractGraph, place: dict[int, int], planned: set[tuple[int, int, Option]]
) -> list[ShownEdge]:
    """Edges off the plan; one is enough of several that lead back between the same nodes."""
    shown, back = [], set()
    for edge in graph.edges:
        if edge.source not in place or edge.target not in place:
            continue
        if (edge.source, edge.target, edge.option) in planned:
            continue
        forward = edge.target > edge.source
        if not forward and (edge.source, edge.target) in back:
            continue
        if not forward:
            back.add((edge.source, edge.target))
        ends = place[edge.source], place[edge.target]
        shown.append(ShownEdge(*ends, edge.option, forward))
    return shown
