# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract planning graph as a picture, layer by layer from the start to the goals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from slap_ros.drawing.captions import PAGE_MARGIN_PX, draw_legend, state_facts, write_header
from slap_ros.drawing.cards import LARGE, SMALL, Card, cut, list_bodies, make_card, make_label
from slap_ros.drawing.layout import EdgeLink, GraphLayout, NodeBox, Route, lay_out
from slap_ros.drawing.palette import BACKGROUND, PENS
from slap_ros.drawing.selection import Selection, ShownEdge, select
from slap_ros.drawing.svg import SvgCurve, SvgGroup, SvgPicture, SvgShape
from slap_ros.drawing.words import AtomNaming
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.plan import Plan
from slap_ros.relational import AtomSpace
from slap_ros.relational.articles import counted

MANY_NODES = 64  # with more, cards are small and only the plan's edges have labels
MIN_WIDTH_PX = 560.0  # room for the title and the legend
ABOVE_PX, BELOW_PX = 20.0, 28.0  # between the graph and what stands around it
CARD_MARGIN = 1.6  # between cards, of their font size


def draw_abstract_graph(
    graph: AbstractGraph, space: AtomSpace, plan: Plan | None, title: str
) -> str:
    """Draw the graph from left to right, the plan's path highlighted.

    The start node lists the fluent atoms that hold in it; every other node lists in what it
    differs from the start node. Pointing at a card or an edge shows it in full.

    Args:
        graph: Graph to draw. Of a very large one only a part is shown, and the picture says so.
        space: Atoms of the graph's task.
        plan: Plan from the graph's start node, or None where there is none.
        title: Title above the picture.

    Returns:
        A self-contained SVG 1.1 document.
    """
    return compose(graph, space, plan, title).markup()


def compose(graph: AbstractGraph, space: AtomSpace, plan: Plan | None, title: str) -> SvgPicture:
    """The picture as shapes.

    Args:
        graph: Graph to draw; see :func:`draw_abstract_graph`.
        space: Atoms of the graph's task.
        plan: Plan from the graph's start node; None where there is none.
        title: Title above the picture.
    """
    selection, words = select(graph, plan), AtomNaming(space)
    many = len(selection.nodes) > MANY_NODES
    cards = _cards(selection, words, graph.nodes[0], many)
    labels = [
        make_label(edge, words) if edge.is_forward and (edge.step or not many) else None
        for edge in selection.edges
    ]
    layout = _arrange(selection, cards, labels)
    width = max(layout.width, MIN_WIDTH_PX)
    facts = state_facts(graph, words, plan, selection)
    header = list(write_header(title, facts, width))
    top = header[-1].area.bottom + ABOVE_PX
    layout = layout.moved(PAGE_MARGIN_PX + (width - layout.width) / 2, top)
    legend, bottom = draw_legend(selection, top + layout.height + BELOW_PX, width)
    shapes: list[SvgShape] = [
        *header,
        *_draw_edges(selection, labels, layout),
        *_draw_nodes(selection, cards, layout, words),
        *legend,
    ]
    size = width + 2 * PAGE_MARGIN_PX, bottom + PAGE_MARGIN_PX
    return SvgPicture(*size, title, " ".join(facts), BACKGROUND, shapes)


def _cards(selection: Selection, words: AtomNaming, start: int, many: bool) -> list[Card]:
    """The cards of nodes; of many nodes, only the plan's have room for all lines."""
    bodies = list_bodies(selection, words, start)
    common = Counter(line.content for body in bodies for line in body)
    cards = []
    for node, body in zip(selection.nodes, bodies, strict=True):
        style = SMALL if many and not node.on_plan else LARGE
        cards.append(make_card(node, cut(body, style.max_lines, common), style))
    return cards


def _arrange(
    selection: Selection, cards: Sequence[Card], labels: Sequence[Card | None]
) -> GraphLayout:
    boxes = [
        NodeBox(node.depth, card.size, CARD_MARGIN * card.style.text_px)
        for node, card in zip(selection.nodes, cards, strict=True)
    ]
    links = [
        EdgeLink(edge.source, edge.target, label.size if label else None, edge.step is not None)
        for edge, label in zip(selection.edges, labels, strict=True)
    ]
    return lay_out(boxes, links)


def _draw_nodes(
    selection: Selection, cards: Sequence[Card], layout: GraphLayout, words: AtomNaming
) -> Iterator[SvgGroup]:
    for node, card, area in zip(selection.nodes, cards, layout.boxes, strict=True):
        yield SvgGroup(f"State {node.number}: {words.sentence(node.atoms)}", card.shapes(area))


def _draw_edges(
    selection: Selection, labels: Sequence[Card | None], layout: GraphLayout
) -> Iterator[SvgGroup]:
    """Those that lead back first, so that the plan's lie on top."""
    drawn = list(zip(selection.edges, labels, layout.routes, strict=True))
    drawn.sort(key=lambda item: (item[0].step is not None, item[0].is_forward))
    for edge, label, route in drawn:
        shapes: list[SvgShape] = list(_curves(edge, route))
        if label is not None and route.label is not None:
            shapes += label.shapes(route.label)
        yield SvgGroup(_edge_title(edge, selection), shapes)


def _curves(edge: ShownEdge, route: Route) -> Iterator[SvgCurve]:
    for i, waypoints in enumerate(route.curves, start=1):
        yield SvgCurve(waypoints, PENS[edge.mark], i == len(route.curves))


def _edge_title(edge: ShownEdge, selection: Selection) -> str:
    source, target = (selection.nodes[i].number for i in (edge.source, edge.target))
    title = f"State {source} to state {target}: {edge.option}"
    if edge.step is None:
        return title
    steps = counted(edge.predicted_steps or 0, "step")
    return f"{title}, number {edge.step} of the plan, {steps} predicted"
