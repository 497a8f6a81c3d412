# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every published figure has a command that makes it again, under its own name."""

import json
import shlex
from dataclasses import fields

import pytest

from benchmarks.robot_bridge import Conditions
from slap_ros.domains import get_domain
from slap_ros.shortcuts.shipped import shipped_library
from slap_ros.shortcuts.shortcut_library import load_library
from tools.reproduce import PUBLISHED, differences, figures, main

# Of a whole ensemble, by OpenGL or a simulated FR3; pages name them.
BY_A_BENCHMARK = {
    "soak",
    "robot_bridge_obstacle_tower",
    "detections_obstacle_tower",
    "franka_obstacle_tower",
    "franka_closed_loop_obstacle_tower",
}


def test_every_figure_has_its_command():
    named = {figure.name for figure in figures()}
    assert named == {path.stem for path in PUBLISHED.glob("*.json")} - BY_A_BENCHMARK
    for figure in figures():
        program, group, study, domain, *_ = shlex.split(figure.command)
        assert (program, group) == ("slap", "study")
        assert figure.name == f"{study}_{domain}"


def test_the_page_of_the_mock_robot_names_the_command_that_made_it():
    data = json.loads((PUBLISHED / "robot_bridge_obstacle_tower.json").read_text(encoding="utf-8"))
    conditions = Conditions(**{field.name: data[field.name] for field in fields(Conditions)})
    assert conditions.command == data["command"]


def test_the_page_has_the_commands_that_are_run():
    page = (PUBLISHED.parent / "reproducing.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    run = [cell.strip("`") for row in rows for cell in row if cell.startswith("`slap study")]
    shown = [row for row in rows if "not run" not in " ".join(row)]
    assert {c for row in shown for c in run if f"`{c}`" in row} == {f.command for f in figures()}


def test_what_will_be_done_is_said_first(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # where nothing is made so far
    assert main(["--list"]) == 0
    said = capsys.readouterr().out
    assert all(f"  {figure.command}\n" in said for figure in figures())
    assert "min of training" in said
    assert said.splitlines()[-1].startswith(f"{len(figures())} figures to make: ")
    assert not list(tmp_path.iterdir())


def test_work_folders_are_those_of_the_libraries_that_ship(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (figure,) = figures(["dynamics_obstacle2d"])
    library = load_library(shipped_library("obstacle2d"), get_domain("obstacle2d"))
    assert [shlex.join(command) for command in figure.trainings] == [library.record["command"]]


def test_other_numbers_are_found_and_times_are_not_compared():
    published = {"rows": [{"steps": 3, "planning_seconds": 0.1}], "seconds": 1.0}
    same = {"rows": [{"steps": 3, "planning_seconds": 9.9, "added": 1}], "seconds": 2.0}
    other = {"rows": [{"steps": 4, "planning_seconds": 0.1}], "seconds": 1.0}
    assert list(differences(published, same)) == []
    assert list(differences(published, other)) == ["found.rows[0].steps"]
    assert list(differences(published, {"rows": []})) == ["found.rows"]
    trained = [{"trained": [{"episodes": 5, "cpu_s": seconds}]} for seconds in (70.0, 80.0)]
    assert list(differences(*trained)) == []


def test_a_figure_that_is_not_there():
    with pytest.raises(LookupError, match="no figure table9_nowhere"):
        figures(["table9_nowhere"])
