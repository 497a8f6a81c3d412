# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results are on stdout, for pipes and files; what else is said is on stderr."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.slap_command import slap

ROOT = Path(__file__).parents[2]
BAG = ROOT / "test" / "bags" / "data" / "recorded_by_0.1.0"
LIBRARY = ROOT / "models" / "skills" / "peg_in_hole"


@pytest.mark.parametrize(
    ("command", "result"),
    [
        (["domains"], "obstacle_tower"),
        (["domains", "stack_at_target"], "predicates"),
        (["skills", LIBRARY], "Insert(?peg: peg, ?hole: hole)"),
        (["bag", "info", BAG], "/slap/state"),
        (["bag", "evaluate", BAG], "0 mismatches"),
        (["bag", "replay", BAG], "0 differ"),
        (["propose", "obstacle2d"], "Pick("),
        (["baseline", "list"], "ppo"),
    ],
    ids=lambda words: "-".join(map(str, words[:2])) if isinstance(words, list) else "",
)
def test_a_result_is_on_stdout_alone(command: list[object], result: str) -> None:
    ran = slap(*command)
    assert ran.exit_code == 0, ran.output
    assert result in ran.stdout
    assert ran.stderr == ""


def test_the_table_of_an_evaluation_is_on_stdout_and_unsolved_tasks_are_not() -> None:
    ran = slap("evaluate", "obstacle2d", "--tasks", 1, "--seeds", 1, "--shortcuts", "none")
    assert ran.exit_code == 0, ran.output
    assert "pure_planning" in ran.stdout and "success [95 %]" in ran.stdout
    assert "pure_planning" not in ran.stderr


def test_damage_is_said_on_stderr(tmp_path: Path) -> None:
    (source,) = BAG.glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(source.read_bytes()[:-2000])
    ran = slap("bag", "evaluate", cut)
    assert "states perceived again" in ran.stdout and "damaged" not in ran.stdout
    assert ran.stderr.startswith("damaged: ")


def test_letters_that_stdout_lacks_are_written_out() -> None:
    """A figure has a plus-minus sign, which ASCII lacks."""
    command = [sys.executable, "-m", "ensemble.cli", "evaluate", "obstacle2d", "--tasks", "1"]
    command += ["--seeds", "1", "--shortcuts", "none"]
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    ran = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=100)
    assert ran.returncode == 0, ran.stderr
    assert "pure_planning" in ran.stdout and r"\xb1" in ran.stdout


def test_a_run_that_solved_its_task_says_so_on_stdout(network: int) -> None:
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--seed", "3"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=100)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.startswith("solved in ") and ran.stdout.count("\n") == 1
    assert "plan 0: " in ran.stderr and "solved in" not in ran.stderr


def test_a_run_that_failed_says_so_on_stderr_alone(network: int) -> None:
    command = [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--seed", "3"]
    command += ["--timeout", "0.1"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=100)
    assert ran.returncode != 0
    last = ran.stderr.splitlines()[-1]
    assert ran.stdout == "" and last.startswith(("error ", "not solved: ")), ran.stderr
