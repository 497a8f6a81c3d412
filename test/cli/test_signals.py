# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C and SIGTERM at any moment: a line, a code, no process left, and files that are whole."""

import itertools
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from slap_ros.bags import evaluate_bag
from support import leftovers
from support.process_state import handles_signals, wait_until

LIBRARY = Path(__file__).parents[1] / "shortcuts" / "data" / "obstacle2d"
LIMIT_S = 120.0  # far more than anything here takes
ENDINGS = {signal.SIGINT: ("interrupted", 130), signal.SIGTERM: ("terminated", 143)}
IN_THE_MIDDLE_S = 1.0  # of processor time: everything is imported by then
EVALUATE = ("evaluate", "obstacle2d", "--tasks", "10000", "--jobs", "2", "--shortcuts", "none")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


@contextmanager
def started(*arguments, folder):
    """A command in a session of its own, as in a terminal of its own; all of it ends."""
    command = [sys.executable, "-m", "ensemble.cli", *map(str, arguments)]
    process = subprocess.Popen(
        command, cwd=folder, text=True, start_new_session=True,
        env=os.environ | {"PYTHONFAULTHANDLER": "1"},  # for a SIGABRT
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        wait_until(lambda: handles_signals(process.pid))
        yield process
    finally:
        for left in in_session(process.pid):
            left.kill()
        process.kill()
        process.communicate()


def in_session(leader):
    """The processes of a session besides its leader."""
    found = []
    for pid in psutil.pids():
        try:
            if os.getsid(pid) == leader != pid:
                found.append(psutil.Process(pid))
        except (ProcessLookupError, PermissionError, psutil.Error):
            continue
    return found


def processor_time(leader):
    """Processor time of a session so far, s: on a busy machine it is as far after as much of it."""
    total = 0.0
    for process in (psutil.Process(leader), *in_session(leader)):
        try:
            times = process.cpu_times()
        except psutil.Error:
            continue
        total += times.user + times.system
    return total


def ends_well(process, number, to_all):
    (os.killpg if to_all else os.kill)(process.pid, number)
    _, told = process.communicate(timeout=LIMIT_S)
    word, code = ENDINGS[number]
    assert process.returncode == code, told
    assert "Traceback" not in told
    assert "leaked" not in told  # semaphores
    assert told.rstrip().splitlines()[-1] == word
    wait_until(lambda: not in_session(process.pid))
    return told


def moves_on(process, condition):
    """Wait, while it runs. Where nothing comes of it, all its processes say where they are."""
    try:
        wait_until(lambda: condition() or process.poll() is not None)
    except AssertionError:
        for pid in leftovers.marked(leftovers.TEST, os.environ[leftovers.TEST]):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGABRT)
        pytest.fail(process.stderr.read())
    if not condition():
        pytest.fail(process.stderr.read())


def pytest_generate_tests(metafunc):
    if "attempt" in metafunc.fixturenames:
        step = 1 if metafunc.config.getoption("--fault-cases") else 4
        metafunc.parametrize("attempt", range(0, 20, step))


def test_ctrl_c_in_the_first_second(tmp_path, attempt):
    with started(*EVALUATE, folder=tmp_path) as process:
        wait_until(lambda: processor_time(process.pid) >= attempt / 20)
        ends_well(process, signal.SIGINT, to_all=True)


@pytest.mark.parametrize(
    "arguments",
    [
        EVALUATE,
        ("study", "goals", "obstacle2d", "--tasks", "500", "--jobs", "2", "--output", "results"),
        ("train", "obstacle2d", "--output", "library"),
        ("check", "obstacle2d", "--tasks", "10000"),
        ("plan", "domain.pddl", "problem.pddl", "--effort", "1000"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_sigterm_in_the_middle(tmp_path, arguments):
    if arguments[0] == "plan":
        hanoi(tmp_path)
    with started(*arguments, folder=tmp_path) as process:
        wait_until(lambda: processor_time(process.pid) > IN_THE_MIDDLE_S)
        ends_well(process, signal.SIGTERM, to_all=False)
    assert not list(tmp_path.rglob("*.draft"))
    assert not (tmp_path / "library").exists()


def hanoi(folder):
    """A problem that takes hours."""
    names, pegs = [f"d{i}" for i in range(14)], ["p1", "p2", "p3"]
    order = [*names, *pegs]
    smaller = [f"(s {b} {a})" for i, a in enumerate(names) for b in order[i + 1 :]]
    tower = [f"(on {a} {b})" for a, b in itertools.pairwise(names)]
    clear = ["(clear d0)", "(clear p2)", "(clear p3)", "(on d13 p1)"]
    (folder / "domain.pddl").write_text("""(define (domain h)
      (:predicates (clear ?x) (on ?x ?y) (s ?x ?y)) (:action move :parameters (?d ?f ?t)
      :precondition (and (s ?t ?d) (on ?d ?f) (clear ?d) (clear ?t))
      :effect (and (clear ?f) (on ?d ?t) (not (on ?d ?f)) (not (clear ?t)))))""")
    (folder / "problem.pddl").write_text(f"""(define (problem p) (:domain h)
      (:objects {" ".join(order)}) (:init {" ".join(smaller + tower + clear)})
      (:goal (and {" ".join(tower)} (on d13 p3))))""")


@pytest.mark.slow
def test_a_run_closes_its_bag(network, tmp_path):
    arguments = ("run", "obstacle2d", "--record", "bag", "--pace", "20", "--shortcuts", "none")
    arguments += ("--patience", "10")  # for a loaded machine
    with started(*arguments, folder=tmp_path) as process:
        recorded = tmp_path / "bag" / "bag_0.mcap"
        # It moves: the topic of commands is announced in the bag with the first of them.
        moves_on(process, lambda: recorded.exists() and b"/slap/command" in recorded.read_bytes())
        told = ends_well(process, signal.SIGTERM, to_all=False)
    assert told.splitlines()[-2:] == ["bag: bag", "terminated"]
    found = evaluate_bag(tmp_path / "bag")
    assert found.damage is None
    assert not found.runs[-1].success


DROPS_IT = """
import os, signal, time
from slap_ros.signals import exit_at_once_on_signals, exit_code, signals_raised

def send():
    os.kill(os.getpid(), {number})
    for _ in range(1000):  # somewhere here the signal is noticed
        pass

class Last:
    def __del__(self):
        send()

if __name__ == "__main__":
    exit_at_once_on_signals()
    try:
        with signals_raised():
            {statement}
            time.sleep(60)
    except KeyboardInterrupt as error:
        raise SystemExit(exit_code(error))
"""
AS_CYTHON_DOES = """
from program import send
try:
    send()
except KeyboardInterrupt:
    pass
"""


@pytest.mark.parametrize("statement", ["Last()", "import compiled"])
@pytest.mark.parametrize("number", ENDINGS)
def test_a_signal_that_falls_where_errors_are_dropped_is_not_lost(number, statement, tmp_path):
    """Python drops what is raised in a destructor, compiled modules what is while they load."""
    (tmp_path / "program.py").write_text(DROPS_IT.format(number=int(number), statement=statement))
    (tmp_path / "compiled.py").write_text(AS_CYTHON_DOES)
    command = [sys.executable, "program.py"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S)
    assert run.returncode == ENDINGS[number][1]
    assert not run.stderr


AT_THE_END = """
import os, sys, time
from slap_ros.signals import exit_at_once_on_signals, signals_raised

class Last:
    def __del__(self, write=os.write, sleep=time.sleep):
        write(1, b"torn down")
        sleep({rest_s})

exit_at_once_on_signals()
last = Last()  # until the modules go
with signals_raised():
    pass
sys.exit(7)
"""


@pytest.mark.parametrize("number", ENDINGS)
def test_a_signal_after_the_work_is_done_does_not_take_the_exit_code_away(number):
    """While modules are torn down, Python has no handlers any more."""
    code = AT_THE_END.format(rest_s=0.5)
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    assert process.stdout.read(1)
    process.send_signal(number)
    process.communicate(timeout=LIMIT_S)
    assert process.returncode == 7


IN_A_STRING = """
import os, signal, typer
from slap_ros.cli.console import exits
from slap_ros.signals import exit_at_once_on_signals

def command():
    exec("os.kill(os.getpid(), signal.SIGINT)\\nfor _ in range(1000): pass")

exit_at_once_on_signals()
typer.run(exits(command))
"""


def test_ctrl_c_while_a_class_is_made_from_a_string_keeps_the_exit_code(tmp_path):
    """Python notes such an interrupt, and kills itself at the end of `python -m`."""
    (tmp_path / "program.py").write_text(IN_A_STRING)
    command = [sys.executable, "-m", "program"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S)
    assert (run.returncode, run.stderr) == (130, "interrupted\n")


WHERE_IT_HURTS = """
import os, signal, sys, threading, time
from slap_ros.learning.workers import local_workers
from slap_ros.signals import exit_at_once_on_signals, exit_code, signals_raised

moments = 0

def look(frame, event, arg):
    global moments
    if frame.f_code.co_name in ("start", "__enter__"):  # of a process or thread, of a lock
        moments += 1
        if moments == {moment}:
            os.kill(os.getpid(), signal.SIGINT)
    return look

if __name__ == "__main__":
    exit_at_once_on_signals()
    # Such as the one that draws progress bars: it takes signals that the main thread has blocked.
    threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()
    try:
        with signals_raised(), local_workers(2) as workers:
            results = workers.run(abs, [(-1,)] * 40)
            sys.settrace(look)
            list(results)
            sys.settrace(None)
    except KeyboardInterrupt as error:
        sys.settrace(None)
        raise SystemExit(exit_code(error))
"""


def test_ctrl_c_while_locks_are_taken_or_processes_started_leaves_neither(tmp_path, attempt):
    """The pool would wait for a lock that was left taken, a lost process would fail aloud."""
    program = tmp_path / "program.py"
    program.write_text(WHERE_IT_HURTS.format(moment=20 * attempt + 11))
    run = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=LIMIT_S)
    assert (run.returncode, run.stderr) == (130, "")


def test_what_is_ignored_stays_ignored(tmp_path):
    """As by nohup, and by a shell that runs something in the background."""
    code = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN);"
        "from slap_ros.signals import exit_at_once_on_signals, signals_raised;"
        "exit_at_once_on_signals()\n"
        "with signals_raised(): signal.raise_signal(signal.SIGINT)\n"
        "sys.exit(7)"
    )
    assert subprocess.run([sys.executable, "-c", code], timeout=LIMIT_S).returncode == 7
