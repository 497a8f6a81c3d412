# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shapes, and how they are written as SVG 1.1.

Only presentation attributes are used: a style sheet inside one of several pictures on a page
would apply to all of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import pairwise
from typing import Protocol
from xml.sax.saxutils import escape, quoteattr

from slap_ros.drawing.layout import Area, RoutePoint
from slap_ros.drawing.text import width_px

FONTS = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', 'DejaVu Sans', Arial, sans-serif"
ASCENT, DESCENT = 0.8, 0.25  # of the font size, above and below the baseline
LEAST_REACH_PX = 10.0  # of a curve's control points: how far it goes on before it bends
Point = tuple[float, float]
Cubic = tuple[Point, Point, Point, Point]  # start, two control points, end
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class SvgShape(Protocol):
    """Anything that can be written."""

    def markup(self) -> str:
        """The SVG element."""
        ...


@dataclass(frozen=True)
class SvgText:
    """A line of text."""

    x: float
    y: float  # of the baseline
    content: str
    size_px: float
    fill: str
    bold: bool = False
    centred: bool = False  # on x, rather than beginning there

    @property
    def area(self) -> Area:
        """What the text covers at most."""
        width = width_px(self.content, self.size_px, self.bold)
        left = self.x - width / 2 if self.centred else self.x
        height = (ASCENT + DESCENT) * self.size_px
        return Area(left, self.y - ASCENT * self.size_px, width, height)

    def markup(self) -> str:
        """See :class:`SvgShape`."""
        attributes = {
            "x": number(self.x),
            "y": number(self.y),
            "font-size": number(self.size_px),
            "fill": self.fill,
        }
        if self.bold:
            attributes["font-weight"] = "600"
        if self.centred:
            attributes["text-anchor"] = "middle"
        return element("text", attributes, clean(self.content))


@dataclass(frozen=True)
class SvgRectangle:
    """A filled rectangle with round corners."""

    area: Area
    fill: str
    stroke: str = "none"
    stroke_px: float = 1.0
    radius_px: float = 4.0

    def markup(self) -> str:
        """See :class:`SvgShape`."""
        return element(
            "rect",
            {
                "x": number(self.area.x),
                "y": number(self.area.y),
                "width": number(self.area.width),
                "height": number(self.area.height),
                "rx": number(self.radius_px),
                "fill": self.fill,
                "stroke": self.stroke,
                "stroke-width": number(self.stroke_px),
            },
        )


@dataclass(frozen=True)
class Pen:
    """How a curve is drawn."""

    colour: str
    width_px: float
    arrow_px: float  # length of an arrowhead
    dashes: str = ""  # px on and off; empty for a solid line


@dataclass(frozen=True)
class SvgCurve:
    """A smooth line through waypoints, with or without an arrowhead at its end."""

    waypoints: Sequence[RoutePoint]
    pen: Pen
    has_head: bool = True

    def beziers(self) -> Iterator[Cubic]:
        """Start, two control points and end of each cubic piece; the head is not covered."""
        points = list(self.waypoints)
        end = points[-1]
        if self.has_head:
            points[-1] = RoutePoint(end.x - end.heading * self.pen.arrow_px, end.y, end.heading)
        for a, b in pairwise(points):
            reach = abs(b.x - a.x) / 2
            if a.heading != b.heading:  # turning back
                reach = max(reach, LEAST_REACH_PX)
            yield (
                (a.x, a.y),
                (a.x + a.heading * reach, a.y),
                (b.x - b.heading * reach, b.y),
                (b.x, b.y),
            )

    def markup(self) -> str:
        """See :class:`SvgShape`."""
        pieces = list(self.beziers())
        path = f"M{_point(pieces[0][0])}" + "".join(_piece(*piece) for piece in pieces)
        attributes = {
            "d": path,
            "fill": "none",
            "stroke": self.pen.colour,
            "stroke-width": number(self.pen.width_px),
        }
        if self.pen.dashes:
            attributes["stroke-dasharray"] = self.pen.dashes
        return element("path", attributes) + (self._head() if self.has_head else "")

    def _head(self) -> str:
        tip = self.waypoints[-1]
        back, half = tip.x - tip.heading * self.pen.arrow_px, self.pen.arrow_px * 0.45
        corners = ((tip.x, tip.y), (back, tip.y - half), (back, tip.y + half))
        points = " ".join(_point(corner) for corner in corners)
        return element("polygon", {"points": points, "fill": self.pen.colour})


@dataclass(frozen=True)
class SvgGroup:
    """Several shapes with one title, which viewers show and screen readers read."""

    title: str
    shapes: Sequence[SvgShape]

    def markup(self) -> str:
        """See :class:`SvgShape`."""
        inner = "".join(shape.markup() for shape in self.shapes)
        return element("g", {}, element("title", {}, clean(self.title)) + inner)


@dataclass(frozen=True)
class SvgPicture:
    """A whole drawing."""

    width: float
    height: float
    title: str
    description: str
    background: str
    shapes: Sequence[SvgShape] = field(default_factory=tuple)

    def markup(self) -> str:
        """The SVG document, without an XML declaration so that HTML can include it."""
        inner = "\n".join(shape.markup() for shape in self.shapes)
        # Pages with several pictures need different identifiers in each.
        key = sha256(f"{self.title}{self.description}{inner}".encode("utf-8", "replace"))
        name = f"graph-{key.hexdigest()[:12]}"
        width, height = number(self.width), number(self.height)
        return element(
            "svg",
            {
                "xmlns": "http://www.w3.org/2000/svg",
                "version": "1.1",
                "width": width,
                "height": height,
                "viewBox": f"0 0 {width} {height}",
                "font-family": FONTS,
                "role": "img",
                "aria-labelledby": f"{name}-title {name}-desc",
            },
            "\n"
            + element("title", {"id": f"{name}-title"}, clean(self.title))
            + element("desc", {"id": f"{name}-desc"}, clean(self.description))
            + SvgRectangle(
                Area(0, 0, self.width, self.height), self.background, radius_px=0
            ).markup()
            + "\n"
            + inner
            + "\n",
        )


def texts(shapes: Sequence[SvgShape]) -> Iterator[SvgText]:
    """Every line of text, those in groups included."""
    for shape in shapes:
        if isinstance(shape, SvgGroup):
            yield from texts(shape.shapes)
        elif isinstance(shape, SvgText):
            yield shape


def element(name: str, attributes: Mapping[str, str], inner: str = "") -> str:
    """An SVG element.

    Args:
        name: Name of the element.
        attributes: Attributes by name; their values are escaped here.
        inner: Markup of the content.
    """
    written = "".join(f" {key}={quoteattr(clean_value(v))}" for key, v in attributes.items())
    return f"<{name}{written}>{inner}</{name}>" if inner else f"<{name}{written}/>"


def clean(text: str) -> str:
    """Text as markup: escaped, and without the characters that XML cannot carry."""
    return escape(clean_value(text))


def clean_value(text: str) -> str:
    """Text with a replacement sign for each character that XML cannot carry."""
    return _NOT_XML.sub("\ufffd", text)


def number(value: float) -> str:
    """A coordinate to a tenth of a pixel."""
    return f"{round(value, 1) + 0.0:.10g}"


def _point(point: Point) -> str:
    return f"{number(point[0])},{number(point[1])}"


def _piece(
    start: Point,
    one: Point,
    other: Point,
    end: Point,
) -> str:
    """A cubic curve, or a level line where the curve is one at the precision written."""
    if number(start[1]) == number(end[1]):
        return f"H{number(end[0])}"
    return f"C{_point(one)} {_point(other)} {_point(end)}"
