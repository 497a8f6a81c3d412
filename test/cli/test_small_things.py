# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Seeds nobody gave, missing folders, other names of commands, and completion in a shell."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ensemble.cli.application import app
from slap_ros.errors import ErrorCode

BAG = Path(__file__).parent.parent / "bags" / "data" / "recorded_by_0.1.0"
RUN = ["run", "obstacle2d", "--in-process", "--shortcuts", "none", "--seed", "1"]
SEED_LINE = "seed 0 (the default; --seed N for another task)"


def slap(*arguments, **environment):
    return CliRunner().invoke(app, arguments, env=environment, prog_name="slap")


@pytest.mark.parametrize("command", [["plan"], ["run", "--in-process"]])
def test_a_seed_that_nobody_gave_is_said_beside_json(command, network):
    arguments = [command[0], "obstacle2d", *command[1:], "--shortcuts", "none", "--json"]
    without, with_seed = slap(*arguments), slap(*arguments, "--seed", "0")
    assert without.exit_code == with_seed.exit_code == 0, without.stderr
    assert SEED_LINE in without.stderr.splitlines()
    assert SEED_LINE not in with_seed.stderr.splitlines()
    seconds = "planning_seconds"
    first, second = (json.loads(ran.stdout) | {seconds: 0} for ran in (without, with_seed))
    assert first == second


ONE_TASK = ["--tasks", "1", "--seeds", "1", "--shortcuts", "none"]


@pytest.mark.parametrize(
    ("command", "file"),
    [
        (["evaluate", "obstacle2d", *ONE_TASK], "trials.json"),
        (["bag", "render", str(BAG)], "run.gif"),
        (["report", str(BAG)], "run.html"),
    ],
    ids=["evaluate", "bag render", "report"],
)
def test_missing_folders_of_an_output_are_made(command, file, tmp_path):
    output = tmp_path / "not" / "yet" / file
    ran = slap(*command, "--output", str(output))
    assert ran.exit_code == 0, ran.stderr
    assert output.stat().st_size > 0


def test_the_outcome_comes_with_the_files_and_without_them(network, tmp_path):
    """Whoever waits for the outcome may open the report; one that fails hides no outcome."""
    (tmp_path / ".b.html.tmp").mkdir()  # a draft's name: only writing it shows that it cannot be
    for name, code in (("a", 0), ("b", ErrorCode.STORAGE_FULL)):
        page = tmp_path / f"{name}.html"
        ran = slap(*RUN, "--report", str(page), "--render", str(tmp_path / f"{name}.gif"))
        assert ran.exit_code == code, ran.stderr
        assert ran.stdout.startswith("solved in ")
        assert page.exists() == (code == 0)
        if code == 0:
            written = [ran.output.index(f"{page}"), ran.output.index("a.gif")]
            assert max(written) < ran.output.index("solved in ")


def test_list_is_domains():
    ran = slap("list", "obstacle2d", "--json")
    assert ran.exit_code == 0, ran.stderr
    assert ran.stdout == slap("domains", "obstacle2d", "--json").stdout


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("slap", "pla"), ["plan"]),
        (("slap", "bag", "exp"), ["export"]),
        (("slap", "run", "obstacle2d", "--wor"), ["--world"]),
        (("slap", "evaluate", "obstacle"), ["obstacle2d", "obstacle_tower"]),
        (("slap", "plan", "obstacle_"), ["obstacle_tower"]),
        (("slap", "domains", "cleanup"), ["cleanup_table"]),
    ],
)
def test_bash_completes_commands_options_and_domains(words, found):
    ran = slap(
        _SLAP_COMPLETE="complete_bash",
        COMP_WORDS=" ".join(words),
        COMP_CWORD=str(len(words) - 1),
    )
    assert ran.exit_code == 0, ran.stderr
    assert ran.stdout.split() == found
