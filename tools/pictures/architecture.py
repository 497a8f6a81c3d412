# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The packages on their floors, and what imports what, as the sources have it.

Of the imports only those are drawn that no chain of others implies: what ``cli`` reaches through
``report`` has no line of its own.
"""

from __future__ import annotations

import runpy
from collections.abc import Iterator, Mapping, Sequence
from graphlib import TopologicalSorter
from itertools import accumulate, pairwise
from pathlib import Path

from slap_ros.drawing.layout import Area, EdgeLink, NodeBox, Route, RoutePoint, Size, lay_out
from slap_ros.drawing.palette import BACKGROUND, BORDER, CARD, INK, MUTED
from slap_ros.drawing.svg import SvgGroup, SvgPicture, SvgRectangle, SvgShape, SvgText, element
from slap_ros.drawing.text import width_px
from tools.imports import ABOVE_THE_CORE, ROOT, all_imports

TITLE = "What imports what"
BOX_PX, TEXT_PX = 26.0, 12.0  # height of a box; font size
PADDING_PX, MARGIN_PX, BETWEEN_PX = 10.0, 20.0, 18.0  # between: boxes of a row
HEAD_PX = 6.0  # length of an arrowhead
SQUEEZE = 0.42  # of the layout's height, which has room for labels that there are not
ROS_TINT, BAND = "#eef4ff", "#f3f4f2"
Floors = Sequence[Sequence[str]]
Imports = Mapping[str, frozenset[str]]


def make(path: Path) -> None:
    """Read the sources and draw them."""
    path.write_text(draw() + "\n", encoding="utf-8")


def draw() -> str:
    """The picture as SVG."""
    floors = read_floors()
    imports = read_imports([package for floor in floors for package in floor])
    return compose(floors, without_implied(imports)).markup()


def read_floors() -> Floors:
    """The order that ``test/test_architecture.py`` keeps, from the top."""
    floors: Floors = runpy.run_path(str(ROOT / "test" / "test_architecture.py"))["FLOORS"]
    return floors


def read_imports(packages: Sequence[str]) -> Imports:
    """Which of the packages each of them imports at run time."""
    found: dict[str, set[str]] = {package: set() for package in packages}
    for each in all_imports():
        if each.imported in found and each.imported != each.importer and each.at_run_time:
            found[each.importer].add(each.imported)
    return {package: frozenset(imported) for package, imported in found.items()}


def without_implied(imports: Imports) -> Imports:
    """The transitive reduction: only what no chain of other imports implies.

    Raises:
        graphlib.CycleError: Packages import one another in a circle.
    """
    reach: dict[str, frozenset[str]] = {}
    for package in TopologicalSorter(imports).static_order():  # what is imported comes first
        reach[package] = imports[package].union(*(reach[below] for below in imports[package]))
    return {
        package: frozenset(
            below
            for below in direct
            if not any(below in reach[other] for other in direct if other != below)
        )
        for package, direct in imports.items()
    }


def compose(floors: Floors, imports: Imports) -> SvgPicture:
    """The picture as shapes.

    Args:
        floors: Names of the packages on each floor, from the top.
        imports: Packages that each package imports; each gets an arrow.
    """
    rows = rows_of(floors, imports)
    names = list(rows)
    # The layout goes from left to right; it is turned by swapping x and y everywhere.
    boxes = [NodeBox(rows[n], Size(BOX_PX, _width(n)), BETWEEN_PX) for n in names]
    links = [
        EdgeLink(names.index(upper), names.index(lower))
        for upper in names
        for lower in sorted(imports[upper])
    ]
    layout = lay_out(boxes, links)
    down = _Squeeze(sorted({area.x for area in layout.boxes}))
    areas = [_turned(area, down) for area in layout.boxes]
    width = layout.height + 2 * MARGIN_PX
    height = max(area.bottom for area in areas) + MARGIN_PX
    shapes: list[SvgShape] = [*_bands(floors, dict(zip(names, areas, strict=True)), width)]
    for route, link in zip(layout.routes, links, strict=True):
        title = f"{names[link.source]} imports {names[link.target]}"
        shapes.append(SvgGroup(title, [_Arrow(route, down)]))
    for name, area in zip(names, areas, strict=True):
        shapes += _box(name, area)
    description = "Packages from the nodes at the top to errors at the bottom; imports run down."
    return SvgPicture(width, height, TITLE, description, BACKGROUND, shapes)


def rows_of(floors: Floors, imports: Imports) -> dict[str, int]:
    """The row of each package: a floor whose packages import one another has several."""
    rows: dict[str, int] = {}
    first = 0
    for floor in floors:
        depth: dict[str, int] = {}
        for package in floor:  # imports within a floor run to the right
            above = [depth[other] for other in depth if package in imports[other]]
            depth[package] = max(above, default=-1) + 1
        rows |= {package: first + depth[package] for package in floor}
        first += max(depth.values()) + 1
    return rows


class _Squeeze:
    """Takes room out of the gaps between rows."""

    def __init__(self, tops: Sequence[float]) -> None:
        self._tops = tops
        gaps = [(b - a - BOX_PX) * SQUEEZE + BOX_PX for a, b in pairwise(tops)]
        self._new = list(accumulate([MARGIN_PX, *gaps]))

    def __call__(self, x: float) -> float:
        """Where something goes."""
        row = max(k for k, top in enumerate(self._tops) if k == 0 or top <= x)
        inside = x - self._tops[row]
        rest = max(0.0, inside - BOX_PX)
        return self._new[row] + min(inside, BOX_PX) + rest * SQUEEZE


def _width(name: str) -> float:
    return width_px(name, TEXT_PX) + 2 * PADDING_PX


def _turned(area: Area, down: _Squeeze) -> Area:
    return Area(area.y + MARGIN_PX, down(area.x), area.height, BOX_PX)


def _bands(floors: Floors, areas: Mapping[str, Area], width: float) -> Iterator[SvgShape]:
    """Every second floor on a ground of its own."""
    for number, floor in enumerate(floors):
        if number % 2 == 0:
            top = min(areas[package].y for package in floor) - 8
            bottom = max(areas[package].bottom for package in floor) + 8
            yield SvgRectangle(Area(4.0, top, width - 8, bottom - top), BAND, radius_px=6.0)


def _box(name: str, area: Area) -> Iterator[SvgShape]:
    ros = name in ABOVE_THE_CORE
    yield SvgRectangle(area, ROS_TINT if ros else CARD, BORDER, 1.0)
    yield SvgText(area.x + area.width / 2, area.middle + 4, name, TEXT_PX, INK, centred=True)


class _Arrow:
    """A route from above to below."""

    def __init__(self, route: Route, down: _Squeeze) -> None:
        self._points = [_lowered(point, down) for curve in route.curves for point in curve]

    def markup(self) -> str:
        """See :class:`slap_ros.drawing.svg.SvgShape`."""
        *points, (x, y) = self._points
        pieces = [f"M{points[0][0]:.1f},{points[0][1]:.1f}"]
        for (x0, y0), (x1, y1) in pairwise([*points, (x, y - HEAD_PX)]):
            middle = (y0 + y1) / 2
            pieces.append(f"C{x0:.1f},{middle:.1f} {x1:.1f},{middle:.1f} {x1:.1f},{y1:.1f}")
        line = {"d": "".join(pieces), "fill": "none", "stroke": MUTED, "stroke-width": "1.1"}
        half = HEAD_PX * 0.45
        corners = ((x, y), (x - half, y - HEAD_PX), (x + half, y - HEAD_PX))
        head = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
        return element("path", line) + element("polygon", {"points": head, "fill": MUTED})


def _lowered(point: RoutePoint, down: _Squeeze) -> tuple[float, float]:
    return point.y + MARGIN_PX, down(point.x)
