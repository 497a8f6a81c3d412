# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line: JSON alone on stdout, one clear line and a code of its own for each refusal."""

import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import pytest
from PIL import Image

from support.slap_command import slap

KEYS = [
    "domain", "preset", "approach", "tasks", "seeds", "success_rate", "plan_length",
    "relative_length", "planning_seconds", "edges_rolled_out",
]  # fmt: skip
LIBRARY = Path(__file__).parent.parent / "shortcuts" / "data" / "obstacle2d"

BAD_DOMAIN = """(define (domain d) (:requirements :strips :typing) (:types thing)
  (:predicates (P ?x - thing))
  (:action A :parameters (?x - thing) :precondition (P ?x) :effect (Missing ?x)))
"""
GOOD_DOMAIN = BAD_DOMAIN.replace("(Missing ?x)", "(not (P ?x))")
UNSOLVABLE = "(define (problem p) (:domain d) (:objects a - thing) (:init) (:goal (P a)))"


def slap_alone(*arguments):
    """In a process of its own: nodes that it starts write to a real stderr."""
    command = [sys.executable, "-m", "ensemble.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=200)


@pytest.mark.parametrize(
    "arguments", [["domains"], ["plan", "obstacle2d"], ["bag", "--help"], ["run", "--help"]]
)
def test_what_brings_no_node_up_needs_no_ros(arguments):
    hide = "import sys; sys.modules |= dict.fromkeys(['rclpy', 'slap_msgs', 'embedded_ros'])"
    command = f"{hide}; from ensemble.cli import main; main()"
    arguments = [sys.executable, "-c", command, *arguments]
    ran = subprocess.run(arguments, capture_output=True, text=True, timeout=200)
    assert ran.returncode == 0, ran.stderr


def test_evaluate_prints_the_agreed_json_and_nothing_else():
    arguments = ["--tasks", 2, "--seeds", 3, "--jobs", 1, "--shortcuts", "none"]
    result = slap("evaluate", "obstacle2d", *arguments, "--json")
    assert result.exit_code == 0, result.stderr
    numbers = json.loads(result.stdout)
    assert list(numbers) == [*KEYS, "approaches", "versions"]
    assert {"pybullet", "pybullet-arm64"} & set(numbers["versions"])  # other versions, other plans
    (row,) = numbers["approaches"]
    assert {key: row[key] for key in KEYS} == {key: numbers[key] for key in KEYS}
    assert numbers["success_rate"] == 1.0
    assert numbers["relative_length"] == 1.0
    assert numbers["approach"] == "pure_planning"
    assert set(numbers["plan_length"]) == set(numbers["planning_seconds"]) == {"mean", "sd"}


@pytest.mark.slow
def test_evaluate_solves_everything_and_depends_on_the_seed_alone():
    arguments = ["evaluate", "obstacle2d", "--tasks", 5, "--seeds", 4, "--jobs", 1, "--json"]
    arguments += ["--shortcuts", "none"]
    first = json.loads(slap(*arguments).stdout)
    assert first["success_rate"] == 1.0
    again = json.loads(slap(*arguments, "--planner", "exhaustive").stdout)
    assert first["plan_length"] == again["plan_length"]
    assert first["edges_rolled_out"]["mean"] <= again["edges_rolled_out"]["mean"] / 2
    other = json.loads(slap(*arguments, "--first-seed", 100).stdout)
    assert other["plan_length"] != first["plan_length"]


def without_seconds(numbers):
    return [
        {key: value for key, value in row.items() if key != "planning_seconds"}
        for row in [{k: v for k, v in numbers.items() if k != "approaches"}, *numbers["approaches"]]
    ]


@pytest.mark.slow
def test_with_a_library_three_approaches_are_compared_on_the_same_tasks():
    arguments = ["evaluate", "obstacle2d", "--tasks", 2, "--seeds", 2, "--json", "--samples", 4]
    arguments += ["--jobs", 1, "--shortcuts", LIBRARY]
    result = slap(*arguments)
    assert result.exit_code == 0, result.stderr
    numbers = json.loads(result.stdout)
    pure, paper, ours = numbers["approaches"]
    names = [row["approach"] for row in (pure, paper, ours)]
    assert names == ["pure_planning", "slap_1_sample", "slap"]
    assert {key: ours[key] for key in KEYS} == {key: numbers[key] for key in KEYS}
    assert pure["shortcut_share"] == 0.0 < ours["shortcut_share"] < 1.0
    assert ours["relative_length"] == ours["plan_length"]["mean"] / pure["plan_length"]["mean"] < 1
    assert ours["plan_length"]["mean"] <= paper["plan_length"]["mean"]
    alone = json.loads(slap(*arguments[:-2], "--shortcuts", "none").stdout)
    assert without_seconds(alone)[1] == without_seconds(numbers)[1]
    side_by_side = json.loads(slap(*arguments, "--jobs", 2).stdout)
    assert without_seconds(side_by_side) == without_seconds(numbers)


@pytest.mark.parametrize("command", ["evaluate", "plan", "run"])
@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [("domain", "obstacle_tower", "not of 'obstacle2d'"), ("format", 99, "format 99")],
)
def test_a_library_of_something_else_is_refused(tmp_path, command, entry, value, words):
    library = shutil.copytree(LIBRARY, tmp_path / "library")
    about = json.loads((library / "library.json").read_text()) | {entry: value}
    (library / "library.json").write_text(json.dumps(about))
    result = slap(command, "obstacle2d", "--shortcuts", library)
    assert result.exit_code == 17, result.stderr
    assert result.stdout == ""
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("error ")
    assert words in line


def test_what_of_a_library_is_damaged_is_left_out_with_a_warning(tmp_path):
    library = shutil.copytree(LIBRARY, tmp_path / "library")
    (policy,) = library.glob("*/policy.safetensors")
    policy.write_bytes(b"")
    arguments = ["plan", "obstacle2d", "--seed", 1, "--json"]
    damaged = slap(*arguments, "--shortcuts", library)
    assert damaged.exit_code == 0, damaged.stderr
    (warning,) = damaged.stderr.strip().splitlines()
    assert warning.startswith("warning a shortcut is left out: ")
    assert str(policy) in warning
    assert damaged.stdout == slap(*arguments, "--shortcuts", "none").stdout


def test_a_plan_with_a_shortcut_is_drawn_with_it(tmp_path):
    arguments = ["plan", "obstacle2d", "--seed", 1, "--shortcuts", LIBRARY, "--samples", 4]
    result = slap(*arguments, "--output", tmp_path, "--json")
    assert result.exit_code == 0, result.stderr
    plan = json.loads(result.stdout)
    (learned,) = [edge["option"] for edge in plan["plan"] if edge["option"].startswith("Clear_On")]
    drawn = (tmp_path / "graph.svg").read_text()
    assert f"{learned}, number 2 of the plan" in drawn
    assert "a learned shortcut on the plan" in drawn
    ET.fromstring(drawn)


def test_plan_writes_pddl_that_it_can_plan_for_and_a_picture(tmp_path):
    result = slap(
        "plan",
        "obstacle2d",
        "--seed",
        3,
        "--shortcuts",
        "none",
        "--output",
        tmp_path / "out",
        "--json",
    )
    assert result.exit_code == 0, result.stderr
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
        (["plan", "obstacle2d", "--preset", "bystanders=1"], 15, "one, fair:bystanders=1"),
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
        (["evaluate", "obstacle2d", "--shortcuts", "nowhere"], 17, "nowhere: no such folder"),
        (["skills", "."], 17, ".: no library, as it has no library.json"),
        (["propose", "stow_hammer", "--operators", "no"], 15, "read no: No such file or directory"),
        (
            ["plan", "obstacle2d", "--planner", "ff", "--shortcuts", LIBRARY],
            15,
            "ff plans without shortcuts",
        ),
        (["bag", "info", "nowhere"], 90, "nowhere"),
        (["bag", "evaluate", "/dev/null"], 90, "/dev/null"),
        (["report", "nowhere", "--output", "page.html"], 90, "nowhere"),
        (["report", "nowhere", "--output", "page.txt"], 15, "ends in .html, not 'page.txt'"),
        (["run", "obstacle2d", "--report", "page.txt"], 15, "ends in .html, not 'page.txt'"),
        (["plan", "absent.pddl", "problem.pddl"], 15, "absent.pddl"),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, code, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = slap(*arguments)
    assert result.exit_code == code, result.stderr
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
    assert result.exit_code in code, result.stderr
    (line,) = result.stderr.strip().splitlines()
    assert words in line


def test_a_bag_is_never_overwritten(tmp_path):
    (tmp_path / "bag").mkdir()
    result = slap("run", "obstacle2d", "--record", tmp_path / "bag")
    assert result.exit_code == 93
    assert list((tmp_path / "bag").iterdir()) == []


def test_a_bag_that_another_run_has_begun_meanwhile_is_not_called_this_ones(network, tmp_path):
    """The recorder alone sees it: a link to nothing is no bag yet, and cannot be made one."""
    bag = tmp_path / "bag"
    bag.symlink_to("nowhere")
    ran = slap_alone("run", "obstacle2d", "--record", bag, "--report", tmp_path / "run.html")
    assert ran.returncode == 93, ran.stderr
    assert "recorder_node ended: BAG_EXISTS" in ran.stderr
    assert "bag: " not in ran.stdout + ran.stderr
    assert list(tmp_path.iterdir()) == [bag]


@pytest.mark.parametrize(
    "command", [[], ["run"], ["evaluate"], ["plan"], ["bag"], ["report"], ["doctor"]]
)
def test_help_is_there(command):
    result = slap(*command, "--help")
    assert result.exit_code == 0
    assert "Usage: " in result.stdout


def test_usage_errors_are_code_2():
    assert slap("run").exit_code == 2
    assert slap("evaluate", "obstacle2d", "--tasks", "0").exit_code == 2


def test_what_cannot_be_rendered_is_refused_before_anything_runs(tmp_path):
    for arguments, words in (
        (["obstacle_tower", "--render", tmp_path / "a.avi"], "ends in .gif or .mp4, not 'a.avi'"),
        (["obstacle_tower", "--render", tmp_path / "a"], "ends in .gif or .mp4, not 'a'"),
        (["obstacle_tower", "--size", "640x480"], "--size is for --render"),
        (["obstacle_tower", "--render", tmp_path / "a.gif", "--size", "641x480"], "not '641x480'"),
        (["obstacle_tower", "--render", tmp_path / "a.gif", "--size", "9999x2"], "not '9999x2'"),
    ):
        result = slap("run", *arguments)
        assert result.exit_code == 15
        assert words in result.stderr


@pytest.mark.slow
def test_a_recorded_tower_is_rendered_frame_by_frame(network, tmp_path):
    bag, gif, mp4 = tmp_path / "bag", tmp_path / "run.gif", tmp_path / "run.mp4"
    goal = ("--goal", "(Holding robot block4)")
    run = slap_alone(
        "run",
        "obstacle_tower",
        *goal,
        "--record",
        bag,
        "--render",
        mp4,
        "--json",
        "--size",
        "320x200",
        "--patience",
        "10",
        "--in-process",
    )
    assert run.returncode == 0, run.stderr
    rendered = slap("bag", "render", bag, "--output", gif)
    assert rendered.exit_code == 0, rendered.stderr
    frames = json.loads(run.stdout)["plan_length"] + 1
    with Image.open(gif) as picture:
        assert picture.n_frames == frames
    video = cv2.VideoCapture(str(mp4))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == frames
    width, height = (video.get(p) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    assert (width, height) == (320, 200)
