# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes of nodes: what they are told apart by, how they end, and what outlives what."""

import json
import os
import signal
import sys
import time
from pathlib import Path

import psutil
import pytest

from ensemble.fork_server import EXIT_CODE
from ensemble.node_process import ForkServer
from slap_ros.errors import NodeDiedError

LIMIT = 30.0  # s
NODES = {
    "patient": "import time\ndef main():\n    time.sleep(3600)\n",
    "broken": "import nothing_of_this_name\n",
    "refusing": "def main():\n    return 57\n",
    "reading": "import sys\ndef main():\n    return len(sys.stdin.read())\n",
    "telling": """
import os, sys
def main():
    print(os.getsid(0) == os.getpid(), *sys.argv[1:])
    return 0
""",
}


@pytest.fixture(autouse=True)
def nodes(tmp_path, monkeypatch):
    for name, code in NODES.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "node.py").write_text(code)
    paths = [str(tmp_path), str(Path(__file__).parents[2])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*paths, *sys.path]))


def until(condition):
    end = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_each_ends_with_its_own_code_and_says_why(capfd):
    with ForkServer(NODES) as server:
        refusing, broken = server.run(["refusing"]), server.run(["broken"])
        for node, code in ((refusing, 57), (broken, 1)):
            assert node.wait(LIMIT)
            assert node.poll() == code
        # Only now: it prints word by word where output is not buffered, amid what others print.
        told = server.run(["telling", "--ros-args", "-p", 'text:="two words"'])
        assert told.wait(LIMIT)
        assert told.poll() == 0
        out, err = capfd.readouterr()
        assert "No module named 'nothing_of_this_name'" in err
        assert 'True --ros-args -p text:="two words"' in err, "in a session of its own"
        assert not out, "standard output is the command's"


def test_it_has_a_name_nothing_to_read_and_ends_when_it_is_told_to():
    with ForkServer(NODES) as server:
        patient = server.run(["patient"])
        until(lambda: psutil.Process(patient.pid).name() == "patient")
        assert server.run(["reading"]).wait(LIMIT), "a request would be read by a node"
        assert patient.poll() is None
        patient.terminate()
        assert patient.wait(LIMIT)
        assert patient.poll() == -signal.SIGTERM
        patient.kill()  # of a number that may be another's by now: nobody


def test_an_answer_that_ctrl_c_kept_from_being_read_is_not_taken_for_the_next():
    with ForkServer(NODES) as server:
        refusing = server.run(["refusing"])
        psutil.wait_procs([psutil.Process(refusing.pid)], LIMIT / 30)
        for _ in range(3):
            server._process.stdin.write(f"{json.dumps((-5, EXIT_CODE, refusing.pid))}\n")
        assert refusing.poll() == 57
        assert server.run(["patient"]).poll() is None


def test_no_node_outlives_the_server():
    with ForkServer(NODES) as server:
        patient = psutil.Process(server.run(["patient"]).pid)
        other = server.run(["patient"])
        server._process.kill()
        assert not psutil.wait_procs([patient], LIMIT)[1]
        assert other.poll() == -signal.SIGKILL
        with pytest.raises(NodeDiedError, match="the process that starts the nodes has died"):
            server.run(["patient"])
