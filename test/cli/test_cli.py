# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line: JSON alone on stdout, one clear line and a code of its own for each refusal."""

import json
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest
from PIL import Image

KEYS = [
    "domain", "preset", "approach", "tasks", "seeds", "success_rate", "plan_length",
    "relative_length", "planning_seconds", "edges_rolled_out",
]  # fmt: skip

BAD_DOMAIN = """(define (domain d) (:requirements :strips :typing) (:types thing)
  (:predicates (P ?x - thing))
  (:action A :parameters (?x - thing) :precondition (P ?x) :effect (Missing ?x)))
"""
GOOD_DOMAIN = BAD_DOMAIN.replace("(Missing ?x)", "(not (P ?x))")
UNSOLVABLE = "(define (problem p) (:domain d) (:objects a - thing) (:init) (:goal (P a)))"


def slap(*arguments, **options):
    command = [sys.executable, "-m", "slap_ros.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=90, **options)


def test_evaluate_prints_the_agreed_json_and_nothing_else():
    result = slap("evaluate", "obstacle2d", "--tasks", 2, "--seeds", 3, "--json")
    assert result.returncode == 0, result.stderr
    numbers = json.loads(result.stdout)
    assert list(numbers) == KEYS
    assert numbers["success_rate"] == 1.0
    assert numbers["relative_length"] == 1.0
    assert numbers["approach"] == "pure_planning"
    assert set(numbers["plan_length"]) == set(numbers["planning_seconds"]) == {"mean", "sd"}


def test_evaluate_solves_everything_and_depends_on_the_seed_alone():
    arguments = ["evaluate", "obstacle2d", "--tasks", 10, "--seeds", 5, "--json"]
    first = json.loads(slap(*arguments, "--shortcuts", "none").stdout)
    assert first["success_rate"] == 1.0
    again = json.loads(slap(*arguments, "--planner", "exhaustive").stdout)
    assert first["plan_length"] == again["plan_length"]
    assert first["edges_rolled_out"]["mean"] <= again["edges_rolled_out"]["mean"] / 2
    other = json.loads(slap(*arguments, "--first-seed", 100).stdout)
    assert other["plan_length"] != first["plan_length"]


def test_plan_writes_pddl_that_it_can_plan_for_and_a_picture(tmp_path):
    result = slap("plan", "obstacle2d", "--seed", 3, "--output", tmp_path / "out", "--json")
    assert result.returncode == 0, result.stderr
    plan = json.loads(result.stdout)
    assert plan["predicted_steps"] == sum(edge["predicted_steps"] for edge in plan["plan"])
    ET.parse(tmp_path / "out" / "graph.svg")
    files = [tmp_path / "out" / name for name in ("domain.pddl", "problem.pddl")]
    symbolic = json.loads(slap("plan", *files, "--json").stdout)
    assert len(symbolic["plan"]) == len(plan["plan"])


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["run", "moon"], 10, "unknown domain 'moon'; there are obstacle2d"),
        (["evaluate", "moon"], 10, "unknown domain 'moon'"),
        (["plan", "obstacle2d", "--preset", "easy"], 15, "unknown preset 'easy'"),
        (["run", "obstacle2d", "--planner", "best"], 15, "unknown planner 'best'"),
        (["plan", "obstacle2d", "--goal", "(On sofa target)"], 13, "unknown object 'sofa'"),
        (["plan", "obstacle2d", "--goal", "(Above block1 table)"], 14, "Above"),
        (["plan", "obstacle2d", "--goal", "(On block1)"], 18, "takes 2 objects"),
        (["plan", "obstacle2d", "--goal", "(On block1 target"], 12, "<goal>:1:"),
        (
            ["plan", "obstacle2d", "--goal", "(and (Holding robot block1) (Holding robot block2))"],
            30,
            "the goal holds in none",
        ),
        (["evaluate", "obstacle2d", "--shortcuts", "nowhere"], 17, "nowhere"),
        (["bag", "info", "nowhere"], 90, "nowhere"),
        (["bag", "evaluate", "/dev/null"], 90, "/dev/null"),
        (["plan", "absent.pddl", "problem.pddl"], 15, "absent.pddl"),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, code, words, tmp_path):
    result = slap(*arguments, cwd=tmp_path)
    assert result.returncode == code, result.stderr
    assert result.stdout == ""
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error ")
    assert words in line


@pytest.mark.parametrize(
    ("domain", "problem", "code", "words"),
    [
        (BAD_DOMAIN, UNSOLVABLE, (11, 12, 14), "Missing"),
        ("(define (domain d)\n  (:predicates (P ?x)", UNSOLVABLE, (12,), "domain.pddl:"),
        (GOOD_DOMAIN, UNSOLVABLE, (30,), "goal"),
        (GOOD_DOMAIN, UNSOLVABLE.replace("(P a)", "(P b)"), (13,), "b"),
    ],
    ids=["unknown predicate", "truncated", "unsolvable", "unknown object"],
)
def test_bad_pddl_is_refused_with_its_place(tmp_path, domain, problem, code, words):
    (tmp_path / "domain.pddl").write_text(domain)
    (tmp_path / "problem.pddl").write_text(problem)
    result = slap("plan", tmp_path / "domain.pddl", tmp_path / "problem.pddl")
    assert result.returncode in code, result.stderr
    (line,) = result.stderr.strip().splitlines()
    assert words in line


def test_a_bag_is_never_overwritten(tmp_path):
    (tmp_path / "bag").mkdir()
    result = slap("run", "obstacle2d", "--record", tmp_path / "bag")
    assert result.returncode == 93
    assert list((tmp_path / "bag").iterdir()) == []


@pytest.mark.parametrize("command", [[], ["run"], ["evaluate"], ["plan"], ["bag"], ["doctor"]])
def test_help_is_there(command):
    result = slap(*command, "--help")
    assert result.returncode == 0
    assert "Usage: " in result.stdout


def test_usage_errors_are_code_2():
    assert slap("run").returncode == 2
    assert slap("evaluate", "obstacle2d", "--tasks", "0").returncode == 2


def test_what_cannot_be_rendered_is_refused_before_anything_runs(tmp_path):
    for arguments, words in (
        (["obstacle2d", "--render", tmp_path / "a.gif"], "obstacle2d has no pictures"),
        (["obstacle_tower", "--render", tmp_path / "a.mp4"], "a.gif"),
    ):
        result = slap("run", *arguments)
        assert result.returncode == 15
        assert words in result.stderr


def test_a_recorded_tower_is_rendered_frame_by_frame(network, tmp_path):
    bag, gif = tmp_path / "bag", tmp_path / "run.gif"
    run = slap(
        "run", "obstacle_tower", "--goal", "(Holding robot block1)", "--record", bag, "--json"
    )
    assert run.returncode == 0, run.stderr
    rendered = slap("bag", "render", bag, "--output", gif)
    assert rendered.returncode == 0, rendered.stderr
    with Image.open(gif) as picture:
        assert picture.n_frames == json.loads(run.stdout)["plan_length"] + 1
