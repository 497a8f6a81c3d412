# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from slap_ros.bags import evaluate_bag
from slap_ros.bags.recording import Recording
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.evaluation.run_log import RunLog
from slap_ros.messages.interfaces import ATOMS, DOMAIN_INFO, MARKERS, PLAN, STATE
from slap_ros.relational import Type
from slap_ros.report import check_output, read_report, render, write_page
from slap_ros.report.traces import robot_series
from support.page_reader import Page
from support.slap_command import slap
from support.staged_runs import HOSTILE, with_markers
from support.truthful_run import Script, record

MIB = 2**20
Bags = dict[str, Path]


def page_of(*bags: Path) -> Page:
    return Page(render([read_report(bag) for bag in bags]))


def exit_code(*arguments: object) -> int:
    return slap(*arguments).exit_code


@pytest.mark.parametrize("name", ["pure", "learned", "hostile", "tower"])
def test_the_numbers_are_those_of_evaluate_to_the_digit(bags: Bags, name: str) -> None:
    page = page_of(bags[name])
    (run,) = evaluate_bag(bags[name]).runs
    assert page.data("metrics") == [run.as_json()]
    shown = [attributes["value"] for tag, attributes in page.elements if tag == "data"]
    assert shown == [str(run.plan_length), repr(run.planning_seconds)]
    assert page.texts["data"] == [str(run.plan_length), f"{run.planning_seconds:.3f}"]


@pytest.mark.parametrize(
    ("bound", "words"),
    [
        (1.0, "proven to be the shortest"),
        (1.25, "at most 1.25 times the shortest"),
        (1.1, "at most 1.10 times the shortest"),
        (501 / 500, "at most 1.01 times the shortest"),  # at most, and not proven
        (0.0, None),
        (1e308, None),
        (math.inf, None),
    ],
)
def test_a_page_says_how_far_from_the_shortest_the_first_plan_is(
    script: Script, tmp_path: Path, bound: float, words: str | None
) -> None:
    messages = copy.deepcopy(script.messages)
    next(item.message for item in messages if item.type_name == PLAN).bound = bound
    record(tmp_path / "bag", messages)
    page = page_of(tmp_path / "bag")
    told = [text for text in page.texts["dd"] if "shortest" in text]
    assert told == ([] if words is None else [words])
    assert page.texts["dt"].count("first plan") == len(told)


def test_a_run_is_told_from_its_first_step_to_its_last(bags: Bags) -> None:
    ((run,), metrics) = read_report(bags["learned"]).runs, evaluate_bag(bags["learned"]).runs[0]
    assert [span.option for span in run.spans] == list(metrics.options)
    assert [span.start for span in run.spans] == [
        sum(option.steps for option in metrics.options[:i]) for i in range(len(metrics.options))
    ]
    assert [span.is_shortcut for span in run.spans].index(True) == 1
    (incident,) = run.incidents
    assert (incident.kind, incident.reason) == ("diverged", "it ended elsewhere")
    assert incident.step == run.spans[1].start
    assert run.replan_steps == (incident.step,)
    outcomes = [[edge.outcome for edge in chain.edges] for chain in run.chains]
    rest = len(run.spans) - 1
    assert outcomes == [["reached", "diverged"] + ["not begun"] * (rest - 1), ["reached"] * rest]
    assert run.scene is not None
    assert len(run.scene.frames) == metrics.plan_length + 1


def test_the_chain_of_states_is_that_of_the_perceived_atoms(bags: Bags) -> None:
    """In Obstacle 2D every option does what its operator says, so both must agree."""
    (run,) = read_report(bags["pure"]).runs
    (chain,) = run.chains
    rows = {row.text: row.intervals for row in run.atom_timeline.rows}
    held = set(chain.start)
    for edge, span in zip(chain.edges, run.spans, strict=True):
        assert edge.text == span.text
        held = (held | set(edge.added)) - set(edge.removed)
        perceived = {
            text
            for text, stretches in rows.items()
            if any(a <= span.end <= b for a, b in stretches)
        }
        assert perceived == held & set(rows)
    assert run.goal in held


def test_markers_show_what_the_domain_would(script: Script, bags: Bags, tmp_path: Path) -> None:
    record(tmp_path / "plain", script.messages)
    (with_markers,), (without,) = (
        read_report(bag).runs for bag in (bags["pure"], tmp_path / "plain")
    )
    assert with_markers.scene is not None
    assert without.scene is not None
    for one, other in zip(with_markers.scene.frames, without.scene.frames, strict=True):
        assert [b.position for b in one.bodies] == [b.position for b in other.bodies]
        assert [b.name for b in one.bodies] == [b.name for b in other.bodies]


@pytest.mark.parametrize("number", [math.nan, math.inf, -1e300])
def test_what_cannot_be_drawn_is_left_out(script: Script, tmp_path: Path, number: float) -> None:
    messages = with_markers(script)
    for item in messages:
        if item.type_name == MARKERS:
            item.message.markers[0].pose.position.x = number
            item.message.markers[1].scale.z = number
    record(tmp_path / "bag", messages)
    (run,) = read_report(tmp_path / "bag").runs
    assert run.scene is not None
    left = {body.name for frame in run.scene.frames for body in frame.bodies}
    shown = script.domain.display.bodies(script.domain.task(7).initial_state)
    assert left == {body.name for body in shown[2:]}
    page_of(tmp_path / "bag")


def test_a_clock_that_was_set_shows_the_same(script: Script, bags: Bags, tmp_path: Path) -> None:
    """Set back by a day in the middle of the run: what is shown of a state goes by its step."""
    messages = with_markers(script)
    moment = next(i for i, m in enumerate(messages) if m.type_name == STATE and m.message.step == 7)
    for item in messages[moment:]:
        headers = [marker.header for marker in getattr(item.message, "markers", ())]
        for header in headers[:1] or [item.message.header]:  # all markers of a state share one
            header.stamp.sec -= 86_400
    record(tmp_path / "set", messages)
    (told,), (plain,) = (read_report(bag).runs for bag in (tmp_path / "set", bags["pure"]))
    assert told.scene == plain.scene
    assert [span.start for span in told.spans] == [span.start for span in plain.spans]


def test_the_robot_is_what_its_domain_calls_one(script: Script) -> None:
    renamed = copy.deepcopy(script.messages)
    for item in renamed:
        state = getattr(item.message, "initial_state", item.message)
        for part in (*getattr(item.message, "types", ()), *getattr(state, "objects", ())):
            for name in ("name", "type"):
                if getattr(part, name, "") == "robot":
                    setattr(part, name, "gantry")
    gantry = Type("gantry")
    domain = replace(
        script.domain, types=(*script.domain.types, gantry), robot_types=frozenset({gantry})
    )
    log, recordings = RunLog(), (Recording(), Recording())
    for messages, recording in zip((script.messages, renamed), recordings, strict=True):
        for item in messages:
            recording.add(item.type_name, item.message)
    for item in script.messages:
        log.add(item.type_name, item.message)
    (trace,) = log.traces()
    usual, found = (
        robot_series(trace, recording.episodes[1], recording, known)
        for recording, known in zip(recordings, (script.domain, domain), strict=True)
    )
    assert usual
    assert found == usual


def test_a_run_whose_first_markers_are_nowhere_is_told(script: Script, tmp_path: Path) -> None:
    messages = with_markers(script)
    first = next(item.message for item in messages if item.type_name == MARKERS)
    for marker in first.markers:
        marker.pose.position.x = math.nan
    record(tmp_path / "bag", messages)
    drawn = page_of(tmp_path / "bag").data("frames")["runs"][0]["views"][0]["shapes"]
    assert all(shape["poses"][shape["at"][0]] == ["", "", ""] for shape in drawn)
    assert any(shape["poses"][shape["at"][1]] != ["", "", ""] for shape in drawn)


def test_steps_that_were_not_recorded_are_not_drawn(script: Script, tmp_path: Path) -> None:
    gap = range(5, 9)
    messages = [
        item
        for item in script.messages
        if item.topic not in ("/slap/state", "/slap/atoms") or item.message.step not in gap
    ]
    record(tmp_path / "bag", messages)
    (run,) = read_report(tmp_path / "bag").runs
    assert run.scene is not None
    drawn = [frame.step for frame in run.scene.frames]
    assert drawn == [step for step in range(run.length + 1) if step not in gap]
    assert page_of(tmp_path / "bag").data("frames")["runs"][0]["frames"] == drawn


def test_two_runs_of_one_task_are_compared(bags: Bags) -> None:
    page = page_of(bags["pure"], bags["learned"])
    assert len(page.data("metrics")) == 2
    headings = page.texts["h3"]
    assert {"pure planning", "SLAP"} <= set(headings)
    text = " ".join(page.texts["li"])
    assert "1.00 of the length by pure planning" in text  # the same steps, told twice
    assert not [words for words in page.texts["p"] if "not of the same task" in words]


def test_runs_of_different_tasks_are_not_measured_by_each_other(bags: Bags) -> None:
    page = page_of(bags["pure"], bags["tower"])
    assert [words for words in page.texts["p"] if "not of the same task" in words]
    assert "of the length" not in " ".join(page.texts["li"])


def test_names_from_a_bag_are_text_whatever_they_are(bags: Bags) -> None:
    """Markup that came from a name would be an element or attribute more."""
    hostile, harmless = page_of(bags["hostile"]), page_of(bags["harmless"])
    assert hostile.structure == harmless.structure
    codes = " ".join(hostile.texts["code"])
    for words in HOSTILE[:4]:
        assert words in codes
    assert "49" not in codes
    markup = render([read_report(bags["hostile"])])
    assert not re.search("[\x00-\x08\x0b-\x1f\u202a-\u202e\u2066-\u2069]", markup)


def test_a_page_needs_nothing_but_itself(bags: Bags) -> None:
    page = page_of(bags["pure"], bags["learned"])
    links = [a[key] for _, a in page.elements for key in ("src", "href") if key in a]
    assert all(link is not None and link.startswith(("#", "data:,")) for link in links)
    styles = "".join(page.texts["style"])
    assert "url(" not in styles
    assert "@import" not in styles


def test_a_page_is_of_moderate_size(bags: Bags) -> None:
    """The tower's 13 frames leave room for 300 in 2 MiB."""
    small, full = (len(render([read_report(bags[name])]).encode()) for name in ("pure", "tower"))
    assert full < small + 13 * 5000 < MIB


def test_the_same_bag_makes_the_same_page(bags: Bags) -> None:
    assert render([read_report(bags["tower"])]) == render([read_report(bags["tower"])])


def test_a_damaged_bag_has_the_exit_code_that_evaluate_has(bags: Bags, tmp_path: Path) -> None:
    data = (bags["pure"] / "pure_0.mcap").read_bytes()
    output = tmp_path / "out" / "page.html"
    codes = set()
    for part in (0.0, 0.01, 0.3, 0.6, 0.95):
        cut = tmp_path / f"{part}.mcap"
        cut.write_bytes(data[: int(part * len(data))])
        output.unlink(missing_ok=True)
        code = exit_code("report", cut, "--output", output)
        assert code == exit_code("bag", "evaluate", cut), part
        codes.add((code, output.exists()))
        if output.exists():
            warnings = " ".join(Page(output.read_text()).texts["p"])
            assert "This page shows what there is" in warnings
    assert codes == {(90, False), (90, True)}  # nothing to be read; something to be read


@pytest.mark.parametrize(("change", "code"), [("name", 10), ("feature_names", 91), ("atoms", 94)])
def test_other_bad_bags_have_the_codes_of_evaluate(
    script: Script, tmp_path: Path, change: str, code: int
) -> None:
    messages = copy.deepcopy(script.messages)
    info = next(m.message for m in messages if m.type_name == DOMAIN_INFO)
    if change == "name":
        info.name = "juggling"
    elif change == "feature_names":
        info.types[0].feature_names = ["y", "x"]
    else:
        next(m.message for m in messages if m.type_name == ATOMS).atoms.pop()
    record(tmp_path / "bag", messages)
    output = tmp_path / "page.html"
    assert exit_code("report", tmp_path / "bag", "--output", output) == code
    assert exit_code("bag", "evaluate", tmp_path / "bag") == code
    assert output.exists() == (change == "atoms")


def test_one_bad_bag_among_good_ones_and_nothing_is_written(bags: Bags, tmp_path: Path) -> None:
    output = tmp_path / "page.html"
    output.write_text("what was there")
    assert exit_code("report", bags["pure"], tmp_path / "nowhere", "--output", output) == 90
    assert output.read_text() == "what was there"
    assert list(tmp_path.iterdir()) == [output]


def test_a_page_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StorageFullError, match="file"):
        write_page(tmp_path / "file" / "page.html", "text")
    (tmp_path / "page.html").mkdir()
    with pytest.raises(StorageFullError, match=r"page\.html"):
        write_page(tmp_path / "page.html", "text")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "page.html"]


@pytest.mark.parametrize("name", ["page.txt", "page", "folder.html"])
def test_an_output_that_is_no_page_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.html").mkdir()
    with pytest.raises(InvalidParameterError, match=name):
        check_output(tmp_path / name)


@pytest.mark.slow
def test_a_tower_is_told_without_pybullet(bags: Bags, tmp_path: Path) -> None:
    """What PyBullet is needed for is the second opinion on perception, and the page says so."""
    output = tmp_path / "page.html"
    program = (
        "import sys; sys.modules['pybullet'] = None; from slap_ros.report import *; "
        "from pathlib import Path; "
        "write_page(Path(sys.argv[2]), render([read_report(sys.argv[1])]))"
    )
    subprocess.run([sys.executable, "-c", program, bags["tower"], output], check=True, timeout=200)
    page = Page(output.read_text())
    assert page.data("metrics") == [evaluate_bag(bags["tower"]).runs[0].as_json()]
    assert [words for words in page.texts["li"] if "not checked" in words]


@pytest.mark.slow
def test_a_run_can_be_told_without_keeping_its_bag(network: int, tmp_path: Path) -> None:
    scratch, output = tmp_path / "scratch", tmp_path / "page.html"
    scratch.mkdir()
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--in-process", "--json"]
    command += ["--patience", "10"]  # for a loaded machine
    ran = subprocess.run(
        [*command, "--seed", "3", "--shortcuts", "none", "--report", output],
        capture_output=True,
        text=True,
        timeout=200,
        env=os.environ | {"TMPDIR": str(scratch)},
    )
    assert ran.returncode == 0, ran.stderr
    assert Page(output.read_text()).data("metrics") == [json.loads(ran.stdout)]
    assert list(scratch.iterdir()) == []


def test_a_bag_without_a_run_says_so(script: Script, tmp_path: Path) -> None:
    before = [m for m in script.messages if m.topic in ("/slap/domain", "/slap/task")]
    record(tmp_path / "bag", before)
    assert "no run" in page_of(tmp_path / "bag").texts["h1"]
    assert exit_code("report", tmp_path / "bag", "--output", tmp_path / "page.html") == 0
