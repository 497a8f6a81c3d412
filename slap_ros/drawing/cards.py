# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cards: text about a node or an edge, in a frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from slap_ros.drawing import text
from slap_ros.drawing.layout import Area, Size
from slap_ros.drawing.palette import (
    BACKGROUND,
    BORDER,
    CARD,
    GAINED,
    GOAL,
    INK,
    LOST,
    MUTED,
    PLAN,
    PLAN_TINT,
    SHORTCUT,
    START,
)
from slap_ros.drawing.selection import Selection, ShownEdge, ShownNode
from slap_ros.drawing.svg import SvgRectangle, SvgShape, SvgText
from slap_ros.drawing.words import ADDED, REMOVED, AtomNaming
from slap_ros.relational.articles import counted


@dataclass(frozen=True)
class CardStyle:
    """Size of a card's text, and how much of it a card has."""

    text_px: float
    padding_px: float
    max_lines: int
    max_text_px: float  # width

    @property
    def line_px(self) -> float:
        """The distance from one baseline to the next."""
        return self.text_px * 1.4


LARGE = CardStyle(text_px=11.5, padding_px=8.0, max_lines=14, max_text_px=260.0)
SMALL = CardStyle(text_px=9.0, padding_px=4.0, max_lines=3, max_text_px=150.0)
LABEL = CardStyle(text_px=10.5, padding_px=5.0, max_lines=4, max_text_px=220.0)


@dataclass(frozen=True)
class CardLine:
    """A line on a card."""

    content: str
    fill: str = INK
    bold: bool = False


@dataclass(frozen=True)
class Card:
    """Lines of text in a frame."""

    lines: tuple[CardLine, ...]
    style: CardStyle
    fill: str
    stroke: str
    stroke_px: float
    double: bool = False  # a second frame inside the first

    @property
    def size(self) -> Size:
        """Width and height that the text needs."""
        style = self.style
        widths = (text.width_px(line.content, style.text_px, line.bold) for line in self.lines)
        height = len(self.lines) * style.line_px
        return Size(max(widths) + 2 * style.padding_px, height + 2 * style.padding_px)

    def shapes(self, area: Area) -> list[SvgShape]:
        """The card in its place, text to the left, a frame around the whole area."""
        shapes: list[SvgShape] = [SvgRectangle(area, self.fill, self.stroke, self.stroke_px)]
        if self.double:
            inner = Area(area.x + 3, area.y + 3, area.width - 6, area.height - 6)
            shapes.append(SvgRectangle(inner, "none", self.stroke, 1.0, 2.0))
        return [*shapes, *self._text(area)]

    def _text(self, area: Area) -> Iterator[SvgText]:
        style = self.style
        for i, line in enumerate(self.lines):
            baseline = area.y + style.padding_px + i * style.line_px + style.text_px
            x = area.x + style.padding_px
            yield SvgText(x, baseline, line.content, style.text_px, line.fill, line.bold)


def list_bodies(selection: Selection, words: AtomNaming, start: int) -> list[list[CardLine]]:
    """Lines that each card would have, given the room.

    Args:
        selection: Nodes and edges that are drawn.
        words: Names of the task's atoms.
        start: Atoms of the start node, as a mask.

    Returns:
        One list per node: the atoms of the start node, and how the others differ from it.
    """
    return [
        [CardLine(d, difference_colour(d)) for d in words.differences(start, node.atoms)]
        if node.number > 0
        else [CardLine(atom) for atom in words.atoms(node.atoms)]
        for node in selection.nodes
    ]


def cut(lines: list[CardLine], limit: int, common: Counter[str]) -> list[CardLine]:
    """The lines of a card; if there are too many, those that are on the fewest cards.

    Args:
        lines: Lines of one card.
        limit: Largest number of lines.
        common: Number of cards that have each line. The rarest lines say most about a card.
    """
    if len(lines) <= limit:
        return lines
    rarest = sorted(lines, key=lambda line: common[line.content])[: limit - 1]
    kept = [line for line in lines if line in rarest]
    return [*kept, CardLine(f"… {len(lines) - len(kept)} more", MUTED)]


def make_card(node: ShownNode, body: Sequence[CardLine], style: CardStyle) -> Card:
    """A node's card.

    Args:
        node: Node of the graph; its role gives heading and frame.
        body: Lines below the heading.
        style: Size of the text.
    """
    heading, colour = _heading(node)
    lines = [CardLine(heading, colour, bold=True), *body]
    return Card(
        tuple(_fitting(line, style) for line in lines),
        style,
        PLAN_TINT if node.on_plan else CARD,
        PLAN if node.on_plan else GOAL if node.is_goal else BORDER,
        2.0 if node.on_plan else 1.0,
        double=node.is_goal,
    )


def _heading(node: ShownNode) -> tuple[str, str]:
    roles = [role for role, has in (("START", node.number == 0), ("GOAL", node.is_goal)) if has]
    colour = GOAL if node.is_goal else START if roles else MUTED
    number = f"state {node.number}" if roles else f"State {node.number}"
    return " · ".join([*roles, number]), colour


def difference_colour(difference: str) -> str:
    """The colour of an atom that holds in addition, or no longer holds."""
    return {ADDED: GAINED, REMOVED: LOST}[difference[: len(ADDED)]]


def _fitting(line: CardLine, style: CardStyle) -> CardLine:
    content = text.shorten(line.content, style.text_px, style.max_text_px, line.bold)
    return CardLine(content, line.fill, line.bold)


def make_label(edge: ShownEdge, words: AtomNaming) -> Card:
    """An edge's label; on the plan with its number in the plan and its predicted steps."""
    name, *rest = words.option(edge.option)
    if edge.step is None:
        lines = [CardLine(name), *(CardLine(line, MUTED) for line in rest)]
        return _label_card(lines, BACKGROUND, BACKGROUND)
    lines = [
        CardLine(f"{edge.step}. {name}", CARD, bold=True),
        *(CardLine(line, CARD) for line in rest),
    ]
    lines.append(CardLine(counted(edge.predicted_steps or 0, "step"), CARD, bold=True))
    colour = SHORTCUT if edge.is_shortcut else PLAN
    return _label_card(lines, colour, colour)


def _label_card(lines: Sequence[CardLine], fill: str, stroke: str) -> Card:
    return Card(tuple(_fitting(line, LABEL) for line in lines), LABEL, fill, stroke, 1.0)
