# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results that many jobs make: interrupted anywhere, they go on to the same bytes."""

import json
from functools import partial
from pathlib import Path

import pytest

from slap_ros.errors import InvalidParameterError
from slap_ros.learning.finished_jobs import cached_jobs
from slap_ros.learning.work_folder import WorkFolder
from slap_ros.learning.workers import SequentialWorkers, run_in_order

JOBS = 5
STEPS = ("plans", "after plans")  # a result of two steps, as some are


class Interrupting:
    """Ctrl-C when so many jobs of a step are done; a step that cannot be reached for never."""

    def __init__(self, step=None, done=0):
        self._at, self.seen = (step, done), []

    def on_progress(self, what, done, total):
        self.seen.append((what, done, total))
        if (what, done) == self._at:
            raise KeyboardInterrupt


def job(number, step, log):
    """Numbers that are hard to write, a text in place of a result, and a note that it was made."""
    with Path(log).open("a") as file:
        file.write(f"{step} {number}\n")
    return f"no plan in {number} ∅" if number == 3 else {"b": number / 3, "a": [1e300, -0.0, None]}


class BackwardWorkers(SequentialWorkers):
    """The last job ends first."""

    def run(self, function, jobs):
        yield from reversed(list(super().run(function, jobs)))


def compute(workers, log, callback, finished):
    return [
        result
        for step in STEPS
        for result in run_in_order(
            workers, job, [(n, step, str(log)) for n in range(JOBS)], step, callback, finished
        )
    ]


def made(folder, callback, workers=None):
    work, log = WorkFolder(folder), folder.with_suffix(".log")
    return cached_jobs(
        work, "part/whole", partial(compute, workers or SequentialWorkers(), log, callback), list
    )


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "work"
    made(folder, Interrupting())
    return (folder / "part/whole.json").read_bytes()


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("done", range(JOBS + 1))
def test_no_job_is_done_twice_and_the_bytes_are_the_same(tmp_path, undisturbed, step, done):
    folder = tmp_path / "work"
    with pytest.raises(KeyboardInterrupt):
        made(folder, Interrupting(step, done))
    assert not (folder / "part/whole.json").exists()
    again = Interrupting()
    made(folder, again)
    assert (folder / "part/whole.json").read_bytes() == undisturbed
    assert [path.name for path in (folder / "part").iterdir()] == ["whole.json"]
    did = (tmp_path / "work.log").read_text().splitlines()
    assert sorted(did) == sorted(f"{step} {number}" for step in STEPS for number in range(JOBS))
    assert {(step, 0, JOBS) for step in STEPS} <= set(again.seen)  # whoever shows it sees each step


def test_jobs_may_end_in_any_order(tmp_path, undisturbed):
    folder = tmp_path / "work"
    with pytest.raises(KeyboardInterrupt):
        made(folder, Interrupting(STEPS[0], 2), BackwardWorkers())
    kept = (folder / "part/.whole.jsonl").read_text().splitlines()
    assert [json.loads(line)["job"] for line in kept] == [4, 3]
    made(folder, Interrupting(), BackwardWorkers())
    assert (folder / "part/whole.json").read_bytes() == undisturbed


def interrupted(folder):
    with pytest.raises(KeyboardInterrupt):
        made(folder, Interrupting(STEPS[0], 3))
    return folder / "part/.whole.jsonl"


@pytest.mark.parametrize("cut", [1, 2, 9])
def test_a_line_that_was_not_written_to_its_end_counts_for_nothing(tmp_path, undisturbed, cut):
    kept = interrupted(tmp_path / "work")
    kept.write_bytes(kept.read_bytes()[:-cut])
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "work", Interrupting(STEPS[0], 4))
    assert [json.loads(line)["job"] for line in kept.read_text().splitlines()] == [0, 1, 2, 3]
    made(tmp_path / "work", Interrupting())
    assert (tmp_path / "work/part/whole.json").read_bytes() == undisturbed


@pytest.mark.parametrize("line", ["{", "[]", "3", '{"step": "plans"}', "\x00\x00"])
def test_a_damaged_file_is_refused_by_name(tmp_path, line):
    kept = interrupted(tmp_path / "work")
    kept.write_text(f"{line}\n{kept.read_text()}")
    with pytest.raises(InvalidParameterError, match=r"\.whole\.jsonl, line 1: damaged.*remove it"):
        made(tmp_path / "work", Interrupting())
