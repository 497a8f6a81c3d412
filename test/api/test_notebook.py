# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans, graphs, tasks, runs, domains and reports show themselves; the example notebook runs."""

import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import nbformat
import pytest
from IPython.core.formatters import DisplayFormatter
from nbclient import NotebookClient

import slap_ros

NOTEBOOK = Path(__file__).parents[2] / "examples" / "first_steps.ipynb"
MOST_BYTES = 400_000  # of the notebook with its outputs
ONLY_TEXT = {"text/plain"}
VOID = {"img", "br", "hr", "meta", "link", "input"}


class Balanced(HTMLParser):
    """Fails on a tag that closes another than the last one opened; collects text and sources."""

    def __init__(self, text):
        super().__init__()
        self.open, self.said, self.sources = [], "", []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.sources += [value for name, value in attributes if name in ("src", "srcdoc")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.said += data


def shown(value):
    """What a notebook shows of a value, by media type."""
    return DisplayFormatter().format(value)[0]


def test_a_plan_is_drawn_as_its_path(plan):
    found = shown(plan)
    assert set(found) == {"text/plain", "image/svg+xml"}
    assert found["text/plain"] == str(plan)
    text = "".join(ET.fromstring(found["image/svg+xml"]).itertext())
    assert f"A plan of {plan.steps} steps" in text
    for edge in plan.plan.edges:
        assert edge.option.skill.name in text


def test_the_whole_graph_can_be_drawn(plan):
    text = "".join(ET.fromstring(shown(plan.graph)["image/svg+xml"]).itertext())
    assert f"{plan.graph_nodes} abstract states" in text


def test_a_plan_without_a_graph_is_text(domain, task):
    assert set(shown(slap_ros.plan(domain, task, planner="astar"))) == ONLY_TEXT


def test_a_run_has_a_table_and_pictures_of_its_first_and_last_state(run):
    page = Balanced(shown(run)["text/html"])
    assert f"{run.steps} steps, solved" in page.said
    for edge in run.edges:
        assert edge.option in page.said
    assert len(page.sources) == 2
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)


def test_domains_and_tasks_say_what_they_are(domain, task):
    said = Balanced(shown(domain)["text/html"]).said
    assert all(operator.name in said for operator in domain.operators)
    assert shown(domain)["text/plain"] == "obstacle2d, preset fair"
    said = Balanced(shown(task)["text/html"]).said
    assert "seed 1, index 0" in said
    assert all(str(atom) in said for atom in task.goal)


def test_pythons_prompt_shows_what_print_shows(domain, task, plan, run):
    for shown in (domain, task, plan, plan.graph, run):
        assert repr(shown) == f"<{type(shown).__name__}: {shown}>"
    assert repr(task.goal) == "frozenset({On(block1, target)})"


def test_a_report_is_its_own_page(run):
    (page,) = Balanced(shown(run.report())["text/html"]).sources
    assert page.startswith("<!DOCTYPE html>") or "<html" in page
    assert f"solved in {run.steps} steps" in page


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    """A kernel of its own needs some 40 s of processor time, most of it imports and planning."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    stored = [text_of(cell) for cell in notebook.cells]
    NotebookClient(notebook, timeout=180, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert [text_of(cell) for cell in notebook.cells] == stored


def text_of(cell):
    """What a cell has printed."""
    return [out["text"] for out in cell.get("outputs", ()) if out["output_type"] == "stream"]


def test_the_notebook_is_stored_with_its_outputs_and_small():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs for cell in code)
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert NOTEBOOK.stat().st_size < MOST_BYTES
    assert not re.search(r"/(home|root|work)/", NOTEBOOK.read_text(encoding="utf-8"))
