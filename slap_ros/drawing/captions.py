# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands around a drawn graph: title, facts, legend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from slap_ros.drawing import text
from slap_ros.drawing.cards import SMALL, Card, difference_colour
from slap_ros.drawing.layout import Area, RoutePoint
from slap_ros.drawing.palette import CARD, GOAL, INK, MUTED, PENS
from slap_ros.drawing.selection import Selection
from slap_ros.drawing.svg import SvgCurve, SvgShape, SvgText
from slap_ros.drawing.words import ADDED, REMOVED, AtomNaming
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.options import OptionKind
from slap_ros.planning.plan import Plan
from slap_ros.relational.articles import counted

PAGE_MARGIN_PX = 24.0
TITLE_PX, FACT_PX, LEGEND_PX = 18.0, 12.5, 11.0  # font sizes
MEANINGS = {
    "plan": "the plan, with predicted environment steps",
    "shortcut": "a learned shortcut on the plan",
    "option": "another option",
    "other shortcut": "another learned shortcut",
    "back": "leads back; search does not follow it",
}


def state_facts(
    graph: AbstractGraph, words: AtomNaming, plan: Plan | None, selection: Selection
) -> list[str]:
    """The sentences under the title: goal, size of the graph, plan.

    Args:
        graph: Graph that is drawn.
        words: Names of the task's atoms.
        plan: Plan with predicted steps; None where there is none.
        selection: Nodes and edges of the graph that are shown.
    """
    nodes, edges = counted(len(graph.nodes), "abstract state"), counted(len(graph.edges), "option")
    facts = [
        f"Goal: {', '.join(words.atoms(graph.goal)) or 'nothing'}.",
        f"{nodes}, {edges} between them.",
    ]
    if plan is not None:
        facts.append(_plan_fact(plan))
    if selection.hidden:
        facts.append(f"{selection.hidden} states are not shown.")
    return facts


def _plan_fact(plan: Plan) -> str:
    if not plan.edges:
        return "The plan is empty: the goal holds at the start."
    steps = counted(plan.predicted_steps, "step")
    learned = sum(edge.option.kind is OptionKind.SHORTCUT for edge in plan.edges)
    shortcuts = f", {counted(learned, 'learned shortcut')} among them" if learned else ""
    return f"Plan: {counted(len(plan.edges), 'option')}{shortcuts}, {steps} predicted."


def write_header(title: str, facts: Sequence[str], width: float) -> Iterator[SvgText]:
    """The title and the facts below it, broken into lines.

    Args:
        title: Title, shown in bold.
        facts: Sentences below the title, one paragraph each.
        width: Width of the lines, px.
    """
    y = PAGE_MARGIN_PX
    for line in text.wrap(title, TITLE_PX, width, bold=True):
        yield SvgText(PAGE_MARGIN_PX, y + TITLE_PX * 0.8, line, TITLE_PX, INK, bold=True)
        y += TITLE_PX * 1.35
    for fact in facts:
        for line in text.wrap(fact, FACT_PX, width):
            yield SvgText(PAGE_MARGIN_PX, y + FACT_PX * 0.9, line, FACT_PX, MUTED)
            y += FACT_PX * 1.4


def draw_legend(selection: Selection, y: float, width: float) -> tuple[list[SvgShape], float]:
    """The legend of the marks that occur, in rows, and the height at which it ends, px.

    Args:
        selection: Nodes and edges that are drawn.
        y: Height at which the first row begins, px from the top.
        width: Width of the rows, px.
    """
    shapes: list[SvgShape] = []
    x, row_px, sample_px = PAGE_MARGIN_PX, 24.0, 30.0
    for kind, meaning in _legend_entries(selection):
        needed = sample_px + 6 + text.width_px(meaning, LEGEND_PX)
        if x > PAGE_MARGIN_PX and x + needed > PAGE_MARGIN_PX + width:
            x, y = PAGE_MARGIN_PX, y + row_px
        shapes += _sample(kind, Area(x, y, sample_px, 14.0))
        shapes.append(SvgText(x + sample_px + 6, y + 11.0, meaning, LEGEND_PX, INK))
        x += needed + 22
    return shapes, y + row_px


def _legend_entries(selection: Selection) -> Iterator[tuple[str, str]]:
    if any(node.number > 0 for node in selection.nodes):
        yield ADDED, "holds, unlike at the start"
        yield REMOVED, "held at the start"
    if any(node.is_goal for node in selection.nodes):
        yield "goal", "the goal holds"
    occurring = {edge.mark for edge in selection.edges}
    yield from ((mark, meaning) for mark, meaning in MEANINGS.items() if mark in occurring)


def _sample(kind: str, area: Area) -> list[SvgShape]:
    """A small picture of a mark."""
    if kind in (ADDED, REMOVED):
        return [
            SvgText(area.x + 10, area.y + 11, kind.strip(), 13.0, difference_colour(kind), True)
        ]
    if kind == "goal":
        return Card((), SMALL, CARD, GOAL, 1.0, double=True).shapes(area)
    ends = RoutePoint(area.x, area.middle, 1), RoutePoint(area.right, area.middle, 1)
    return [SvgCurve(ends, PENS[kind])]
