# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The same command twice at a time: the second is refused, and does not disturb the first."""

import json
import subprocess
import sys
from contextlib import contextmanager

import pytest

from slap_ros.errors import BusyError, ErrorCode
from slap_ros.files import sole_use
from slap_ros.studies.results import Provenance
from slap_ros.studies.study_log import StudyLog
from support.slap_command import slap

ORIGIN = Provenance("obstacle2d", "slap study goals obstacle2d", {})
WORKS = """
import sys
from pathlib import Path
from slap_ros.files import sole_use

with sole_use(Path(sys.argv[1])):
    print("at work", flush=True)
    sys.stdin.read()
"""


@contextmanager
def another_process_in(folder):
    with subprocess.Popen(
        [sys.executable, "-c", WORKS, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == b"at work\n"
        yield
        process.kill()


@pytest.mark.parametrize("command", ["train obstacle2d", "acquire peg_in_hole"])
def test_a_work_folder_is_for_one_process_until_that_ends_however_it_ends(tmp_path, command):
    work, library = tmp_path / "work", tmp_path / "library"
    with another_process_in(work):
        given = [*command.split(), "--work", str(work), "--output", str(library)]
        result = slap(*given)
        assert result.exit_code == ErrorCode.BUSY
        complaint = " ".join(result.stderr.split())
        assert f"another process is at work on {work}: wait until it has ended" in complaint
        assert not library.exists()
    with sole_use(work):
        assert list(work.iterdir()) == []


def test_a_study_under_way_is_for_one_process(tmp_path):
    path = tmp_path / "log"
    with StudyLog(path, ORIGIN) as log:
        log.add("first", 1, 0.0)
        with pytest.raises(BusyError, match="another process is at work on"):
            StudyLog(path, ORIGIN)
        log.add("second", 2, 0.0)
    with StudyLog(path, ORIGIN) as log:
        assert log.results == {"first": 1, "second": 2}


def test_of_studies_begun_together_the_one_with_the_first_result_goes_on(tmp_path):
    path = tmp_path / "results" / "log"
    with StudyLog(path, ORIGIN) as log, StudyLog(path, ORIGIN) as other:
        assert not path.parent.exists()  # nothing is found so far
        log.add("first", 1, 0.0)
        with pytest.raises(BusyError, match="another process is at work on"):
            other.add("first", 1, 0.0)
        log.add("second", 2, 0.0)
    _, *entries = map(json.loads, path.read_text().splitlines())
    assert [entry["job"] for entry in entries] == ["first", "second"]
