# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A study that is killed goes on where it was, and comes to what it would have come to."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from slap_ros.errors import ErrorCode
from slap_ros.learning.workers import SequentialWorkers
from support.marks import slow
from support.slap_command import slap
from support.study_helpers import without_seconds

FOLDER = Path(__file__).parent
LIBRARY = FOLDER.parent / "shortcuts" / "data" / "obstacle2d"
DONE = 3  # jobs, before a study is killed
PLANNING = ["--shortcuts", str(LIBRARY), "--samples", "2"]
STUDIES = {  # one for each kind of result, which is read again
    "table1": ["--library", str(LIBRARY), "--samples", "2", "--preset", "fair", "--tasks", "2"],
    "goals": ["--goals", "3", "--seeds", "1", *PLANNING],
    "perception": ["--tasks", "1", "--seeds", "1", *PLANNING],
    "planning_time": ["--tasks", "1", "--seeds", "2", *PLANNING, "--vary", "bystanders=0,1"],
    "pruning": ["--tasks", "2", "--seeds", "1", *PLANNING],
}
# Runs `slap` in a process that kills itself as soon as so many results are written.
KILLED = """
import os, signal, sys
from pytest import MonkeyPatch
from support.study_helpers import in_this_process
from slap_ros.studies.study_log import StudyLog

left, add = int(sys.argv.pop(1)), StudyLog.add

def add_and_die(log, job, result, cpu_seconds):
    global left
    add(log, job, result, 1000.0)
    left -= 1
    if left == 0:
        log.path.open("a").write('{"job": "a line that was not')  # as the kernel may leave it
        os.kill(os.getpid(), signal.SIGKILL)

in_this_process(MonkeyPatch())
StudyLog.add = add_and_die
from ensemble.cli import main
main()
"""


def command(name, output):
    return ["study", name, "obstacle2d", *STUDIES[name], "--output", str(output)]


def made(name, output):
    result = slap(*command(name, output))
    return result.exit_code, " ".join(result.stderr.split())


def data_of(name, output):
    return json.loads((output / f"{name}_obstacle2d.json").read_text())


@pytest.fixture
def done(monkeypatch):
    """The number of jobs that this process does, one entry per call."""
    counts, run = [], SequentialWorkers.run

    def counted(workers, function, jobs):
        counts.append(len(jobs))
        return run(workers, function, jobs)

    monkeypatch.setattr(SequentialWorkers, "run", counted)
    return counts


@pytest.mark.parametrize("name", ["goals", *slow(*sorted(STUDIES.keys() - {"goals"}))])
def test_a_study_that_is_killed_goes_on_and_comes_to_the_same(tmp_path, name, done, monkeypatch):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    monkeypatch.setenv("PYTHONPATH", str(FOLDER.parent), prepend=":")
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(DONE), *command(name, killed)],
        check=False,
        capture_output=True,
    )
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    (log,) = killed.iterdir()  # no page, not even half of one
    assert log.name == f".{name}_obstacle2d.jsonl"
    assert len(log.read_text().splitlines()) == 1 + DONE + 1
    assert made(name, whole)[0] == 0
    everything = sum(done)
    done.clear()
    assert made(name, killed)[0] == 0
    assert sum(done) == everything - DONE > 0
    one, other = data_of(name, killed), data_of(name, whole)
    assert without_seconds(one) == without_seconds(other)
    before_it_was_killed = 1000.0 * DONE  # seconds, as said above
    assert before_it_was_killed <= one["cpu_seconds"] < before_it_was_killed + 500.0
    assert 0.0 < other["cpu_seconds"] < 500.0
    endings = [".json", ".md", ".svg"]
    assert sorted(path.suffix for path in killed.iterdir()) == endings  # and no log
    if name not in ("planning_time", "table1"):  # their pages have times
        for ending in endings[1:]:
            file = f"{name}_obstacle2d{ending}"
            assert (killed / file).read_bytes() == (whole / file).read_bytes()


@pytest.fixture
def log(tmp_path, monkeypatch):
    """What a study has done that is killed after its first result."""
    monkeypatch.setenv("PYTHONPATH", str(FOLDER.parent), prepend=":")
    subprocess.run([sys.executable, "-c", KILLED, "1", *command("goals", tmp_path)], check=False)
    return tmp_path / ".goals_obstacle2d.jsonl"


def test_what_cannot_be_gone_on_with_is_refused_and_left_as_it_is(log):
    header, first, _ = log.read_text().splitlines()
    other = {**json.loads(header), "command": "slap study goals obstacle2d --goals 7"}
    library = json.loads(header)
    library["settings"]["library"]["digest"] = "0" * 16
    half = json.loads(first)
    del half["result"]["plan_length"]
    for lines, said in (
        ([json.dumps(other), first], "is what `slap study goals obstacle2d --goals 7` has done"),
        ([json.dumps(library), first], "with another library or other settings"),
        ([header, json.dumps(half)], "damaged"),
        ([header, "what is this"], "is no log of a study"),
        ([header, '{"task": 1}'], "is no log of a study"),
        (["[]"], "is no log of a study"),
        (["", ""], "is no log of a study"),
    ):
        text = "".join(f"{line}\n" for line in lines)
        for ending in ("", "cut off"):
            log.write_text(text + ending)
            code, complaint = made("goals", log.parent)
            assert code == ErrorCode.INVALID_PARAMETER
            assert said in complaint
            assert "remove" in complaint
            if "damaged" not in said:
                assert log.read_text() == text + ending
    log.write_bytes(b"\xff\xfe\n")
    assert "is no log of a study" in made("goals", log.parent)[1]
    assert list(log.parent.iterdir()) == [log]


def test_a_study_that_was_killed_as_it_wrote_the_first_line_begins_again(log):
    log.write_text(log.read_text()[:40])
    assert made("goals", log.parent)[0] == 0
    assert not log.exists()


def test_a_folder_in_place_of_a_log_is_refused(tmp_path):
    (tmp_path / ".goals_obstacle2d.jsonl").mkdir()
    code, complaint = made("goals", tmp_path)
    assert code != 0
    assert "a folder, where a file is expected" in complaint
