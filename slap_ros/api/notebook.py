# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How plans, graphs, tasks, runs, domains and reports show themselves in a notebook.

A plan is drawn as its path, and its ``graph`` as all that was searched; a run has pictures of its
first and last state; a report is its own page.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from functools import singledispatch
from html import escape
from io import BytesIO

from slap_ros.api.execution import Run
from slap_ros.core import Display, Domain, PictureSize, Task
from slap_ros.drawing import draw_abstract_graph
from slap_ros.drawing.body_pictures import canvas_of, draw_bodies, viewpoint, visible
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.plan import Plan, PlanningResult
from slap_ros.relational import State
from slap_ros.relational.articles import counted
from slap_ros.report import BagReport, render
from slap_ros.worlds.animation import Picture

PICTURE = PictureSize(320, 240)
PAGE_HEIGHT_PX = 700


@singledispatch
def svg_of(_: object) -> str | None:
    """A picture of an object as SVG; None for types that have none."""
    return None


@singledispatch
def html_of(_: object) -> str | None:
    """An object as HTML; None for types that have none."""
    return None


@svg_of.register
def _graph_svg(graph: AbstractGraph) -> str | None:
    return _drawn(graph, None, "Abstract planning graph")


@svg_of.register
def _plan_svg(result: PlanningResult) -> str | None:
    title = f"A plan of {counted(result.steps, 'step')}"
    return None if result.graph is None else _drawn(_path(result), result.plan, title)


def _path(result: PlanningResult) -> AbstractGraph:
    """The part of the graph that the plan leads through, all of which may be large."""
    assert result.graph is not None
    nodes, edges, here = [result.graph.nodes[0]], [], 0
    for edge in result.plan.edges:
        if edge.target.required not in nodes:
            nodes.append(edge.target.required)
        there = nodes.index(edge.target.required)
        edges.append(Edge(here, there, edge.option))
        here = there
    depth = list(range(len(nodes)))
    return AbstractGraph(result.graph.goal, nodes, depth, edges, result.graph.space)


def _drawn(graph: AbstractGraph, plan: Plan | None, title: str) -> str | None:
    """A graph, if anybody has said what its masks stand for."""
    return None if graph.space is None else draw_abstract_graph(graph, graph.space, plan, title)


@html_of.register
def _domain_html(domain: Domain) -> str:
    rows = [
        ("types", [kind.name for kind in domain.types]),
        ("predicates", [predicate.name for predicate in domain.predicates]),
        ("operators", [str(operator) for operator in domain.operators]),
        ("goals", domain.goals),
        ("configuration", [f"{key} {value}" for key, value in domain.configuration.items()]),
    ]
    listed = [(title, ", ".join(entries) or "none") for title, entries in rows]
    return _heading(f"{domain.name}, preset {domain.preset}") + _table(listed)


@html_of.register
def _task_html(task: Task) -> str:
    origin = "given" if task.seed < 0 else f"seed {task.seed}, index {task.index}"
    objects = ", ".join(f"{obj.name} ({obj.type.name})" for obj in task.initial_state.objects)
    goal = ", ".join(sorted(map(str, task.goal)))
    rows = [("objects", objects), ("goal", goal), ("step limit", str(task.step_limit))]
    return _heading(f"Task, {origin}") + _table(rows)


@html_of.register
def _run_html(run: Run) -> str:
    end = "solved" if run.success else f"not solved: {run.error}"
    rows = [
        (
            f"{edge.option}({', '.join(edge.objects)})",
            edge.kind,
            str(edge.steps),
            "reached" if edge.reached else "missed",
        )
        for edge in run.edges
    ]
    pictures = state_pictures(run.domain.display, [run.states[0], run.states[-1]])
    table = _table(rows, ("option", "kind", "steps", "target"))
    return _heading(f"{counted(run.steps, 'step')}, {end}") + table + pictures


@html_of.register
def _report_html(report: BagReport) -> str:
    style = f"width: 100%; height: {PAGE_HEIGHT_PX}px; border: 0"
    page = escape(render([report]), quote=True)
    return f'<iframe title="report" style="{style}" srcdoc="{page}"></iframe>'


def state_pictures(display: Display, states: Sequence[State]) -> str:
    """Plain drawings of states side by side, as HTML; empty where a domain displays no bodies."""
    scenes = [visible(display, state) for state in states]
    if not all(scenes):
        return ""
    view = viewpoint(scenes)
    canvas = canvas_of(scenes, view, PICTURE)
    images = "".join(_image(draw_bodies(bodies, view, canvas, PICTURE)) for bodies in scenes)
    return f'<div style="display: flex; flex-wrap: wrap">{images}</div>'


def _image(picture: Picture) -> str:
    from PIL import Image  # with the physics, as for all pictures

    png = BytesIO()
    Image.fromarray(picture).save(png, "PNG")
    data = b64encode(png.getvalue()).decode()
    width, height = PICTURE
    return f'<img alt="state" width="{width}" height="{height}" src="data:image/png;base64,{data}">'


def _heading(text: str) -> str:
    return f"<p><strong>{escape(text)}</strong></p>"


def _table(rows: Iterable[Sequence[str]], titles: Sequence[str] = ()) -> str:
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    body = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows)
    return f"<table>{''.join(f'<tr>{cells}</tr>' for cells in (head, *body) if cells)}</table>"
