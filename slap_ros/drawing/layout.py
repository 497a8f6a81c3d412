# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Layered layout: where boxes and the links between them go.

Boxes stand in columns, one a layer. Between two columns of boxes is a column for labels. A link
takes a slot in every column that it passes, and bends only in the gaps between columns: so links
never run through boxes or through each other's labels, and nothing overlaps, by construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import fmean

from slap_ros.drawing.ordering import order

LANE_PX = 4.0  # height of a slot in which a link just passes
TURN_PX = 12.0  # height of a slot in which a link turns back
SLOT_MARGIN_PX = 8.0
MIN_GAP_PX = 26.0  # between columns
MAX_GAP_PX = 120.0
GAP_SHARE = 0.12  # of the longest way up or down that a link goes in the gap
PIN = 1e6  # weight of what shall not move, against 1 a link
PORT_PITCH_PX = 16.0  # between links on the side of a box, where there is room
RELAXATIONS = 40  # passes over all columns


@dataclass(frozen=True)
class Size:
    """Width and height, px."""

    width: float
    height: float


@dataclass(frozen=True)
class Area:
    """A rectangle, px; y grows downwards."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The right edge, px."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The lower edge, px."""
        return self.y + self.height

    @property
    def middle(self) -> float:
        """The height of the middle, px."""
        return self.y + self.height / 2

    def moved(self, x: float, y: float) -> Area:
        """The same area, so much further right and down."""
        return Area(self.x + x, self.y + y, self.width, self.height)


@dataclass(frozen=True)
class NodeBox:
    """A box to be placed in the column of its layer."""

    layer: int
    size: Size
    margin: float  # px, to what is above and below


@dataclass(frozen=True)
class EdgeLink:
    """A link to be routed between two boxes. Those of the spine run level, one after the other."""

    source: int
    target: int
    label: Size | None = None
    on_spine: bool = False


@dataclass(frozen=True)
class RoutePoint:
    """A point that a link passes horizontally: heading 1 is to the right, -1 to the left."""

    x: float
    y: float
    heading: int


@dataclass(frozen=True)
class Route:
    """A link's way: one curve, or with a label two, one up to the label and one on from it."""

    curves: tuple[tuple[RoutePoint, ...], ...]
    label: Area | None = None

    def moved(self, x: float, y: float) -> Route:
        """The same route, so much further right and down."""
        curves = (
            tuple(RoutePoint(p.x + x, p.y + y, p.heading) for p in curve) for curve in self.curves
        )
        return Route(tuple(curves), self.label.moved(x, y) if self.label else None)


@dataclass(frozen=True)
class GraphLayout:
    """Areas of the boxes and routes of the links, in the order in which they were given."""

    boxes: tuple[Area, ...]
    routes: tuple[Route, ...]
    width: float
    height: float

    def moved(self, x: float, y: float) -> GraphLayout:
        """The same layout, so much further right and down."""
        return GraphLayout(
            tuple(box.moved(x, y) for box in self.boxes),
            tuple(route.moved(x, y) for route in self.routes),
            self.width,
            self.height,
        )


@dataclass
class _Slot:
    """The part of a column that a box, a label or a passing link has."""

    rank: int
    size: Size
    margin: float
    y: float = 0.0  # of its middle
    on_spine: bool = False
    neighbours: list[int] = field(default_factory=list)


def lay_out(boxes: Sequence[NodeBox], links: Sequence[EdgeLink]) -> GraphLayout:
    """Place the boxes and route the links. The same input gives the same output."""
    slots = [_Slot(2 * box.layer, box.size, box.margin) for box in boxes]
    chains = [_chain(slots, link) for link in links]
    ranks = _ordered_ranks(slots, chains, len(boxes))
    _place(slots, ranks)
    columns = _columns(slots, ranks)
    areas = tuple(_stretched(slot, columns[slot.rank]) for slot in slots[: len(boxes)])
    ports = _ports(slots, areas, links, chains)
    routes = tuple(
        _route(slots, columns, link, chain, port)
        for link, chain, port in zip(links, chains, ports, strict=True)
    )
    bottom = max(slot.y + slot.size.height / 2 for slot in slots)
    return GraphLayout(areas, routes, columns[-1].right, bottom)


def _chain(slots: list[_Slot], link: EdgeLink) -> list[int]:
    """Give a link its slots, in order from source to target, and connect them."""
    start, end = slots[link.source].rank, slots[link.target].rank
    step = 1 if end > start else -1
    passed = [start + 1] if start == end else list(range(start + step, end, step))
    labelled = _label_rank(passed) if link.label else None
    chain = []
    for rank in passed:
        plain = Size(0.0, TURN_PX if start == end else LANE_PX)
        size = link.label if link.label and rank == labelled else plain
        chain.append(len(slots))
        slots.append(_Slot(rank, size, SLOT_MARGIN_PX))
    if start == end:  # the way out and the way back are both between the slot and its left
        ends = [(link.source, chain[0]), (link.target, chain[0])]
    else:
        whole = [link.source, *chain, link.target]
        ends = list(pairwise(whole))
    for one, other in ends:
        slots[one].neighbours.append(other)
        slots[other].neighbours.append(one)
    for slot in (link.source, *chain, link.target):
        slots[slot].on_spine |= link.on_spine
    return chain


def _label_rank(passed: list[int]) -> int:
    """The label column in the middle of the way."""
    columns = [rank for rank in passed if rank % 2 == 1]
    return columns[len(columns) // 2]


def _ordered_ranks(slots: list[_Slot], chains: list[list[int]], boxes: int) -> list[list[int]]:
    """The slots of each rank, top to bottom; at first boxes as given, links between their ends."""
    key = [float(i) for i in range(len(slots))]
    for chain in chains:
        for slot in chain:
            ends = [n for end in (chain[0], chain[-1]) for n in slots[end].neighbours]
            ends = [n for n in ends if n < boxes]
            key[slot] = sum(ends) / len(ends)
    ranks: list[list[int]] = [[] for _ in range(max(slot.rank for slot in slots) + 1)]
    for i in sorted(range(len(slots)), key=lambda i: (key[i], i)):
        ranks[slots[i].rank].append(i)
    before, after = (
        [[n for n in slot.neighbours if slots[n].rank == slot.rank + side] for slot in slots]
        for side in (-1, 1)
    )
    return order(ranks, before, after)


# -- heights ------------------------------------------------------------------------------------


def _place(slots: list[_Slot], ranks: list[list[int]]) -> None:
    """Move slots up and down until links are as straight as the order allows."""
    for rank in ranks:
        _settle(slots, rank, [0.0] * len(rank), [1.0] * len(rank))
    for pass_ in range(RELAXATIONS):
        for rank in ranks if pass_ % 2 == 0 else reversed(ranks):
            wanted, weights = [], []
            for i in rank:
                slot = slots[i]
                mean = fmean(slots[n].y for n in slot.neighbours) if slot.neighbours else slot.y
                wanted.append(0.0 if slot.on_spine else mean)
                weights.append(PIN if slot.on_spine else max(1.0, len(slot.neighbours)))
            _settle(slots, rank, wanted, weights)
    top = min(slot.y - slot.size.height / 2 for slot in slots)
    for slot in slots:
        slot.y -= top


def _settle(
    slots: list[_Slot], rank: list[int], wanted: Sequence[float], weights: Sequence[float]
) -> None:
    """Put a rank's slots as near to the wanted heights as their order and sizes allow.

    Least squares under minimum distances is isotonic regression once the distances are
    subtracted; neighbours that want to change places are pooled.
    """
    offsets, offset = [], 0.0
    for k, i in enumerate(rank):
        if k > 0:
            above = slots[rank[k - 1]]
            margin = max(above.margin, slots[i].margin)
            offset += (above.size.height + slots[i].size.height) / 2 + margin
        offsets.append(offset)
    pools: list[tuple[float, float, int]] = []  # mean, weight, number of slots
    for k in range(len(rank)):
        mean, weight, number = wanted[k] - offsets[k], weights[k], 1
        while pools and pools[-1][0] >= mean:
            other, more, members = pools.pop()
            mean = (mean * weight + other * more) / (weight + more)
            weight, number = weight + more, number + members
        pools.append((mean, weight, number))
    means = [mean for mean, _, number in pools for _ in range(number)]
    for i, mean, offset in zip(rank, means, offsets, strict=True):
        slots[i].y = mean + offset


# -- columns and ways ---------------------------------------------------------------------------


def _columns(slots: list[_Slot], ranks: list[list[int]]) -> list[Area]:
    """The column of each rank; wider gaps where links have far to go up or down."""
    columns: list[Area] = []
    x = 0.0
    for rank, members in enumerate(ranks):
        if rank > 0:
            ways = [
                abs(slots[i].y - slots[n].y)
                for i in members
                for n in slots[i].neighbours
                if slots[n].rank == rank - 1
            ]
            x += min(MAX_GAP_PX, MIN_GAP_PX + GAP_SHARE * max(ways, default=0.0))
        width = max((slots[i].size.width for i in members), default=0.0)
        columns.append(Area(x, 0.0, width, 0.0))
        x += width
    return columns


def _stretched(slot: _Slot, column: Area) -> Area:
    """A box as wide as its column."""
    return Area(column.x, slot.y - slot.size.height / 2, column.width, slot.size.height)


@dataclass(frozen=True)
class _End:
    """Where a link meets a box."""

    link: int
    leaves: bool  # the box, rather than arriving at it
    box: int
    slot: int  # the one next to the box
    on_spine: bool


def _ports(
    slots: list[_Slot], areas: Sequence[Area], links: Sequence[EdgeLink], chains: list[list[int]]
) -> list[tuple[float, float]]:
    """Heights at which each link leaves its source box and enters its target box."""
    sides: dict[tuple[int, bool], list[_End]] = {}  # by box and whether on its right
    for i, (link, chain) in enumerate(zip(links, chains, strict=True)):
        for end in (
            _End(i, True, link.source, chain[0], link.on_spine),
            _End(i, False, link.target, chain[-1], link.on_spine),
        ):
            right = slots[end.slot].rank > slots[end.box].rank
            sides.setdefault((end.box, right), []).append(end)
    heights: dict[tuple[int, bool], float] = {}
    for (box, _), ends in sides.items():
        ends.sort(key=lambda end: slots[end.slot].y)
        for end, height in zip(ends, _port_heights(areas[box], ends), strict=True):
            heights[end.link, end.leaves] = height
    return [(heights[i, True], heights[i, False]) for i in range(len(links))]


def _port_heights(area: Area, ends: Sequence[_End]) -> list[float]:
    """Heights of the ports: around the middle, where the spine is if it is among them."""
    centre = next((k for k, end in enumerate(ends) if end.on_spine), (len(ends) - 1) / 2)
    furthest = max(centre, len(ends) - 1 - centre)
    pitch = min(PORT_PITCH_PX, area.height / 2 / (furthest + 0.5))
    return [area.middle + pitch * (k - centre) for k in range(len(ends))]


def _route(
    slots: list[_Slot],
    columns: list[Area],
    link: EdgeLink,
    chain: list[int],
    ports: tuple[float, float],
) -> Route:
    start, end = slots[link.source].rank, slots[link.target].rank
    heading = 1 if end >= start else -1
    arriving = heading if end != start else -1
    leave = RoutePoint(_edge(columns[start], heading), ports[0], heading)
    enter = RoutePoint(_edge(columns[end], -arriving), ports[1], arriving)
    curves: list[list[RoutePoint]] = [[leave]]
    label = None
    for i in chain:
        slot, column = slots[i], columns[slots[i].rank]
        if start == end:
            into, out = _turn(slot, column)
        else:
            into, out = (
                RoutePoint(_edge(column, side), slot.y, heading) for side in (-heading, heading)
            )
        curves[-1].append(into)
        if link.label and slot.size is link.label:
            label = _centred(slot, column)
            inner = (_edge(label, into.heading * -1), _edge(label, out.heading))
            curves[-1].append(RoutePoint(inner[0], into.y, into.heading))
            curves.append([RoutePoint(inner[1], out.y, out.heading)])
        if out != into:
            curves[-1].append(out)
    curves[-1].append(enter)
    return Route(tuple(tuple(curve) for curve in curves), label)


def _turn(slot: _Slot, column: Area) -> tuple[RoutePoint, RoutePoint]:
    """Into a column from the left and out again to the left."""
    apart = TURN_PX / 2
    return RoutePoint(column.x, slot.y - apart / 2, 1), RoutePoint(column.x, slot.y + apart / 2, -1)


def _centred(slot: _Slot, column: Area) -> Area:
    size = slot.size
    return Area(
        column.x + (column.width - size.width) / 2,
        slot.y - size.height / 2,
        size.width,
        size.height,
    )


def _edge(area: Area, side: int) -> float:
    """The left (-1) or right (1) edge."""
    return area.right if side > 0 else area.x
