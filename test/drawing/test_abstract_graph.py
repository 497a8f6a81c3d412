# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The drawn graph: complete, well-formed, without overlaps, the same every time."""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from slap_ros.domains.obstacle2d import make
from slap_ros.domains.obstacle2d.tasks import make_task
from slap_ros.drawing import abstract_graph as drawing
from slap_ros.drawing import draw_abstract_graph
from slap_ros.drawing.abstract_graph import compose
from slap_ros.drawing.layout import Area
from slap_ros.drawing.palette import OTHER_SHORTCUT_PEN, SHORTCUT_PEN
from slap_ros.drawing.selection import MAX_NODES
from slap_ros.drawing.svg import SvgCurve, SvgGroup, SvgPicture, SvgRectangle, SvgText, texts
from slap_ros.drawing.text import shorten, width_px, wrap
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.options import Option, OptionKind, given_option
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.relational import AtomSpace, Target
from support.programs import PATH, environment

SVG = "{http://www.w3.org/2000/svg}"
PAPER = (0.8, 0.4)  # m, block positions
TWO_BYSTANDERS = (0.8, 0.35, 0.0, 0.99)
TWO_OBSTACLES = (0.72, 0.4, 0.6, 0.0)
SIX_BLOCKS = (0.72, 0.4, 0.6, 0.0, 0.22, 0.94)


@dataclass(frozen=True)
class Case:
    graph: AbstractGraph
    space: AtomSpace
    plan: Plan

    def compose(self, title: str = "A graph") -> SvgPicture:
        return compose(self.graph, self.space, self.plan, title)

    def draw(self, title: str = "A graph") -> str:
        return draw_abstract_graph(self.graph, self.space, self.plan, title)


def obstacle2d(blocks_x: tuple[float, ...], extra_depth: int = 0) -> Case:
    domain, task = make("fair"), make_task((0.5, 1.0), 0.5, list(blocks_x))
    space = domain.atom_space(task.initial_state)
    operators = [
        (ground, given_option(domain, ground.operator.name, ground.objects))
        for ground in domain.ground(space)
    ]
    graph = build_abstract_graph(
        space.abstract(task.initial_state), space.mask(task.goal), operators, extra_depth
    )
    return Case(graph, space, shortest_plan(graph))


def shortest_plan(graph: AbstractGraph) -> Plan:
    arrival: dict[int, Edge] = {}
    for edges in graph.forward_edges():
        for edge in edges:
            arrival.setdefault(edge.target, edge)
    node, edges = graph.goal_nodes[0], []
    while node != 0:
        edges.append(arrival[node])
        node = arrival[node].source
    return Plan(
        tuple(
            PlanEdge(edge.option, Target.exactly(graph.nodes[edge.target]), steps)
            for steps, edge in enumerate(reversed(edges), start=3)
        )
    )


def tangled(seed: int, count: int) -> Case:
    """A graph with edges within layers, over several layers and several between two nodes."""
    base, rng = obstacle2d(TWO_BYSTANDERS), random.Random(seed)
    start, goal = base.graph.nodes[0], base.graph.goal
    free = [1 << i for i in range(len(base.space.atoms)) if not (1 << i) & base.space.static]
    masks = {start: None}
    while len(masks) < count:
        masks.setdefault(sum(bit for bit in free if rng.random() < 0.2), None)
    nodes = [mask & ~goal for mask in masks][:-1]
    nodes = list(dict.fromkeys(nodes))
    nodes.append(nodes[-1] | goal)
    depth = [0] + [1 + i * 5 // len(nodes) for i in range(1, len(nodes))]
    given = base.graph.edges[0].option
    learned = replace(given, kind=OptionKind.SHORTCUT)
    edges = [
        Edge(rng.choice([s for s in range(t) if depth[s] < depth[t]]), t, given)
        for t in range(1, len(nodes))
    ]
    for _ in range(count):
        ends = rng.randrange(len(nodes)), rng.randrange(len(nodes))
        edges += [Edge(*ends, rng.choice((given, learned)))] * (ends[0] != ends[1])
    graph = AbstractGraph(goal, nodes, depth, edges)
    return Case(graph, base.space, shortest_plan(graph))


CASES = {
    "paper": lambda: obstacle2d(PAPER),
    "two bystanders": lambda: obstacle2d(TWO_BYSTANDERS),
    "two obstacles": lambda: obstacle2d(TWO_OBSTACLES),
    "two obstacles, deeper": lambda: obstacle2d(TWO_OBSTACLES, 2),
    "six blocks": lambda: obstacle2d(SIX_BLOCKS, 2),
    "tangled": lambda: tangled(1, 12),
    "tangled, larger": lambda: tangled(2, 50),
    "tangled, many": lambda: tangled(3, 200),
}


@pytest.fixture(params=CASES, scope="module")
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]()


def group_titles(svg: str) -> list[str]:
    root = ElementTree.fromstring(svg)
    return [group.findtext(f"{SVG}title") or "" for group in root.iter(f"{SVG}g")]


def groups(picture: SvgPicture) -> Iterator[SvgGroup]:
    return (shape for shape in picture.shapes if isinstance(shape, SvgGroup))


def card_areas(picture: SvgPicture) -> list[Area]:
    return [
        shape.area
        for group in groups(picture)
        if re.match(r"State \d+:", group.title)
        for shape in group.shapes[:1]
        if isinstance(shape, SvgRectangle)
    ]


def label_areas(picture: SvgPicture) -> dict[str, Area]:
    return {
        group.title: shape.area
        for group in groups(picture)
        if " to state " in group.title
        for shape in group.shapes
        if isinstance(shape, SvgRectangle)
    }


def overlaps(areas: list[Area]) -> list[tuple[Area, Area]]:
    found: list[tuple[Area, Area]] = []
    from_above = sorted(areas, key=lambda area: area.y)
    for i, a in enumerate(from_above):
        for b in from_above[i + 1 :]:
            if b.y >= a.bottom:
                break
            if a.x < b.right and b.x < a.right:
                found.append((a, b))
    return found


def points_on(curve: SvgCurve) -> Iterator[tuple[float, float]]:
    for piece in curve.beziers():
        for t in (i / 24 for i in range(25)):
            weights = ((1 - t) ** 3, 3 * (1 - t) ** 2 * t, 3 * (1 - t) * t**2, t**3)
            x, y = (sum(w * p[k] for w, p in zip(weights, piece, strict=True)) for k in (0, 1))
            yield x, y


def bounds(points: list[tuple[float, float]]) -> Area:
    xs, ys = zip(*points, strict=True)
    return Area(min(xs), min(ys), max(xs) - min(xs) + 1, max(ys) - min(ys) + 1)


def inside(point: tuple[float, float], area: Area, margin: float = 0.5) -> bool:
    x, y = point
    return area.x + margin < x < area.right - margin and area.y + margin < y < area.bottom - margin


# -- completeness -------------------------------------------------------------------------------


def test_every_node_and_edge_is_there(case: Case) -> None:
    titles = group_titles(case.draw())
    for number, mask in enumerate(case.graph.nodes):
        assert f"State {number}: {case.space.describe(mask) or 'no fluent atom holds'}" in titles
    for edge in case.graph.edges:
        if edge.target > edge.source:
            wanted = f"State {edge.source} to state {edge.target}: {edge.option}"
            assert any(title.startswith(wanted) for title in titles), wanted
        else:
            ends = f"State {edge.source} to state {edge.target}: "
            assert any(title.startswith(ends) for title in titles), ends


def test_plan_edges_are_labelled_with_option_and_predicted_steps(case: Case) -> None:
    picture = case.compose()
    for step, edge in enumerate(case.plan.edges, start=1):
        (group,) = (g for g in groups(picture) if f", number {step} of the plan, " in g.title)
        said = [text.content for text in texts(group.shapes)]
        assert f"{step}. {edge.option.skill.name}" in said
        assert f"{edge.predicted_steps} steps" in said


def test_start_says_what_holds_and_others_what_differs() -> None:
    case = obstacle2d(PAPER)
    said = {
        group.title.split(":")[0]: [text.content for text in texts(group.shapes)]
        for group in groups(case.compose())
    }
    assert said["State 0"] == [
        "START · state 0",
        "On(block1, table)",
        "Overlap(block2, target)",
        "GripperEmpty",
        "Clear(table)",
    ]
    assert said["State 1"] == [
        "State 1",
        "+ Holding(block1)",
        "\N{MINUS SIGN} On(block1, table)",
        "\N{MINUS SIGN} GripperEmpty",
    ]
    assert said["State 7"][0] == "GOAL · state 7"


def test_small_graphs_label_forward_edges_and_no_others() -> None:
    case = obstacle2d(TWO_BYSTANDERS)
    labelled = label_areas(case.compose())
    forward = [e for e in case.graph.edges if e.target > e.source]
    assert len(labelled) == len(forward) < len(case.graph.edges)


def test_large_graphs_label_the_plan_only() -> None:
    case = obstacle2d(SIX_BLOCKS, 2)
    assert len(case.graph.nodes) > drawing.MANY_NODES
    assert len(label_areas(case.compose())) == len(case.plan.edges)


@pytest.mark.parametrize("name", ["paper", "two bystanders", "two obstacles, deeper", "tangled"])
def test_cards_tell_nodes_apart(name: str) -> None:
    case = CASES[name]()
    cards = [
        tuple(text.content for text in texts(group.shapes))[1:]
        for group in groups(case.compose())
        if re.match(r"State \d+:", group.title)
    ]
    assert len(set(cards)) == len(cards) == len(case.graph.nodes)


# -- geometry -----------------------------------------------------------------------------------


def test_no_two_texts_overlap(case: Case) -> None:
    assert overlaps([text.area for text in texts(case.compose("A title " * 40).shapes)]) == []


def test_text_stays_on_its_card_and_in_the_picture(case: Case) -> None:
    picture = case.compose()
    for group in groups(picture):
        frames = [s.area for s in group.shapes if isinstance(s, SvgRectangle)]
        for text in texts(group.shapes):
            area = text.area
            assert frames[0].x <= area.x and area.right <= frames[0].right, text.content
            assert frames[0].y <= area.y and area.bottom <= frames[0].bottom, text.content
    for text in texts(picture.shapes):
        assert text.area.x >= 0 and text.area.right <= picture.width, text.content
        assert text.area.y >= 0 and text.area.bottom <= picture.height, text.content


def test_cards_and_labels_do_not_overlap(case: Case) -> None:
    picture = case.compose()
    assert overlaps([*card_areas(picture), *label_areas(picture).values()]) == []


def test_edges_run_through_no_card_and_no_other_label(case: Case) -> None:
    picture = case.compose()
    cards, labels = card_areas(picture), label_areas(picture)
    for group in groups(picture):
        for curve in (shape for shape in group.shapes if isinstance(shape, SvgCurve)):
            points = list(points_on(curve))
            near = bounds(points)
            for area in cards:
                if overlaps([near, area]):
                    assert not any(inside(point, area) for point in points), group.title
            for title, area in labels.items():
                if title != group.title and overlaps([near, area]):
                    assert not any(inside(point, area) for point in points), group.title


def test_edges_begin_and_end_at_their_cards(case: Case) -> None:
    picture = case.compose()
    cards = card_areas(picture)
    for group in groups(picture):
        if match := re.match(r"State (\d+) to state (\d+):", group.title):
            curves = [shape for shape in group.shapes if isinstance(shape, SvgCurve)]
            for number, end in (
                (int(match[1]), curves[0].waypoints[0]),
                (int(match[2]), curves[-1].waypoints[-1]),
            ):
                area = cards[number]
                assert min(abs(end.x - area.x), abs(end.x - area.right)) < 1e-6
                assert area.y < end.y < area.bottom


def test_plan_that_goes_from_layer_to_layer_runs_level() -> None:
    picture = obstacle2d(TWO_BYSTANDERS).compose()
    heights = {
        round(point.y)
        for group in groups(picture)
        if "of the plan" in group.title
        for shape in group.shapes
        if isinstance(shape, SvgCurve)
        for point in shape.waypoints
    }
    assert len(heights) == 1


# -- robustness ---------------------------------------------------------------------------------


def test_well_formed_and_self_contained(case: Case) -> None:
    svg = case.draw()
    root = ElementTree.fromstring(svg)
    assert root.tag == f"{SVG}svg"
    assert root.get("version") == "1.1"
    assert "href" not in svg and "url(" not in svg and "<style" not in svg and "<script" not in svg
    assert "nan" not in re.findall(r'[\s"]nan[\s"]', svg)


def test_title_and_description_are_for_screen_readers() -> None:
    root = ElementTree.fromstring(obstacle2d(PAPER).draw("Seed 3"))
    title, desc = root.find(f"{SVG}title"), root.find(f"{SVG}desc")
    assert title is not None and title.text == "Seed 3"
    assert desc is not None and "Goal: On(block1, target)." in (desc.text or "")
    assert root.get("aria-labelledby") == f"{title.get('id')} {desc.get('id')}"


def test_two_pictures_on_a_page_have_different_identifiers() -> None:
    case = obstacle2d(PAPER)
    first, second = (set(re.findall(r' id="([^"]+)"', case.draw(t))) for t in ("one", "two"))
    assert len(first) == 2
    assert not first & second


def test_deterministic_across_processes_and_hash_seeds() -> None:
    program = (
        "import sys\n"
        "import test_abstract_graph as t\n"
        "sys.stdout.write(t.obstacle2d(t.TWO_OBSTACLES).draw() + t.tangled(2, 50).draw())"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            env=environment()
            | {
                "PYTHONPATH": os.pathsep.join([PATH, str(Path(__file__).parent)]),
                "PYTHONHASHSEED": seed,
                "PYTHONIOENCODING": "utf-8",
            },
            cwd=Path(__file__).parents[2],
            capture_output=True,
            check=True,
            timeout=200,
        ).stdout
        for seed in ("1", "2")
    ]
    assert outputs[0] == outputs[1] != b""


def test_text_is_escaped() -> None:
    title = "<script>alert('&')</script> \x00 ]]> \ud800 日本"
    svg = obstacle2d(PAPER).draw(title)
    root = ElementTree.fromstring(svg.encode())
    shown = "<script>alert('&')</script> \ufffd ]]> \ufffd 日本"
    assert root.findtext(f"{SVG}title") == shown
    assert not list(root.iter(f"{SVG}script"))


def test_empty_plan_where_the_goal_holds_already() -> None:
    base = obstacle2d(PAPER)
    start = base.graph.nodes[0]
    graph = build_abstract_graph(start, start & ~base.space.static, [])
    picture = compose(graph, base.space, Plan(()), "Nothing to do")
    assert len(card_areas(picture)) == 1
    said = [text.content for text in texts(picture.shapes)]
    assert "START · GOAL · state 0" in said
    assert "The plan is empty: the goal holds at the start." in said
    assert "1 abstract state, 0 options between them." in said
    assert overlaps([text.area for text in texts(picture.shapes)]) == []


def test_without_a_plan() -> None:
    case = obstacle2d(PAPER)
    picture = compose(case.graph, case.space, None, "No plan")
    said = [text.content for text in texts(picture.shapes)]
    assert not any("plan" in line for line in said if line != "No plan")
    assert not any("of the plan" in group.title for group in groups(picture))


def test_plan_that_leaves_the_graph_is_drawn_whole() -> None:
    case = obstacle2d(PAPER)
    option = case.graph.edges[0].option
    outside = case.graph.nodes[0] & case.space.static
    plan = Plan(
        (
            PlanEdge(option, Target.exactly(outside), 4),
            PlanEdge(option, Target.exactly(case.graph.nodes[7]), 9),
        )
    )
    picture = compose(case.graph, case.space, plan, "Elsewhere")
    assert len(card_areas(picture)) == len(case.graph.nodes) + 1
    assert sum("of the plan" in group.title for group in groups(picture)) == 2


def test_huge_graph_shows_the_plan_and_says_what_is_missing() -> None:
    case = tangled(4, 600)
    picture = case.compose()
    assert len(card_areas(picture)) == MAX_NODES
    assert sum("of the plan" in group.title for group in groups(picture)) == len(case.plan.edges)
    hidden = len(case.graph.nodes) - MAX_NODES
    assert f"{hidden} states are not shown." in [t.content for t in texts(picture.shapes)]


def test_learned_shortcuts_say_so() -> None:
    case = obstacle2d(PAPER)
    given = case.graph.edges[0].option
    shortcut = Option(OptionKind.SHORTCUT, given.skill, given.objects)
    graph = replace(case.graph, edges=[*case.graph.edges, Edge(0, 7, shortcut)])
    plan = Plan((PlanEdge(shortcut, Target.exactly(graph.nodes[7]), 6),))
    said = [t.content for t in texts(compose(graph, case.space, plan, "Shortcut").shapes)]
    assert "learned shortcut" in said


def test_shortcuts_look_different_on_the_plan_and_off_it() -> None:
    case = obstacle2d(PAPER)
    given = case.graph.edges[0].option
    shortcut = Option(OptionKind.SHORTCUT, given.skill, given.objects)
    graph = replace(case.graph, edges=[*case.graph.edges, Edge(0, 7, shortcut)])
    plan = Plan((PlanEdge(shortcut, Target.exactly(graph.nodes[7]), 6),))
    for taken, meaning in ((plan, "a learned shortcut on the plan"), (None, "another learned")):
        picture = compose(graph, case.space, taken, "shortcuts")
        edges = [shape for shape in picture.shapes if isinstance(shape, SvgGroup)]
        (drawn,) = [e for e in edges if e.title.startswith("State 0 to state 7")]
        pens = {shape.pen for shape in drawn.shapes if isinstance(shape, SvgCurve)}
        assert pens == {SHORTCUT_PEN if taken else OTHER_SHORTCUT_PEN}
        assert any(meaning in text.content for text in texts(picture.shapes))


# -- legibility ---------------------------------------------------------------------------------


def luminance(colour: str) -> float:
    channels = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    linear = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def test_text_contrast() -> None:
    picture = obstacle2d(TWO_BYSTANDERS).compose()
    pairs = {(t.fill, picture.background) for t in picture.shapes if isinstance(t, SvgText)}
    for group in groups(picture):
        fills = [s.fill for s in group.shapes if isinstance(s, SvgRectangle)]
        pairs |= {(text.fill, fills[0]) for text in texts(group.shapes)}
    assert len(pairs) > 5
    for ink, paper in pairs:
        darker, lighter = sorted((luminance(ink), luminance(paper)))
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5, (ink, paper)


def test_shorten_and_wrap_keep_within_their_limits() -> None:
    assert shorten("short", 12, 200) == "short"
    for limit in (20, 50, 90):
        assert width_px(shorten("a_rather_long_name", 12, limit), 12) <= limit
        lines = wrap("several words and a_rather_long_word", 12, limit)
        assert all(width_px(line, 12) <= limit for line in lines)
    assert wrap("two words", 12, 500) == ["two words"]
