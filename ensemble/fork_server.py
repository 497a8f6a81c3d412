# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m ensemble.fork_server``: imports what nodes need once, and forks a process for each.

Imports take most of the time until a node is ready, and all nodes import much the same.
``ensemble.node_process`` asks, one line of JSON at a time; nothing is read ahead, so that a forked
process inherits no request.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from typing import TextIO

from ensemble.startup import main_of

RUN, EXIT_CODE = "run", "exit code"  # requests: of a node's arguments, of a process's number

PR_SET_PDEATHSIG, PR_SET_NAME = 1, 15  # <sys/prctl.h>
LIBC = ctypes.CDLL(None)  # opened here: after a fork, and before an exec, nothing may be loaded


def main() -> int:
    """Serve until nobody can ask any more; in a forked process, run its node.

    Returns:
        The exit code.
    """
    answers = _own_answers()
    for name in sys.argv[1:]:
        # A node whose import fails tries it again, and says so as it would in any process.
        with suppress(Exception):
            import_module(f"{name}.node")
    if "ensemble.interfaces" in sys.modules:  # at least one of them is on the network
        _prepare_types()
    gc.freeze()  # else the first collection in a node writes to, and so copies, all pages
    arguments = _serve(answers)
    if arguments is None:
        return 0
    sys.argv = [*arguments]
    return main_of(arguments[0])


def _prepare_types() -> None:
    from ensemble.interfaces import CALLED, RECORDED
    from ensemble.network import is_embedded

    if is_embedded():  # ROS 2's own has them compiled
        from embedded_ros.preparation import prepare

        prepare(one.type for one in (*RECORDED, *CALLED))


def die_with_parent() -> None:
    """Let this process die with the thread that started it."""
    if sys.platform == "linux":
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _own_answers() -> TextIO:
    """Where answers go: standard output, which from now on is another name of standard error."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return answers


def _serve(answers: TextIO) -> Sequence[str] | None:
    """Answer requests.

    Args:
        answers: Where to.

    Returns:
        In the server, once there are no more requests, None; in a forked process, the arguments
        with which its node is run, of which the first is the node's name.
    """
    server = os.getpid()
    codes: dict[int, int] = {}  # of those that have ended
    for line in iter(sys.stdin.readline, ""):
        number, request, about = json.loads(line)
        answer: int | None
        if request == RUN:
            answer = os.fork()
            if not answer:
                _become_a_node(about[0], server, answers)
                return tuple(about)
        else:
            answer = _exit_code(about, codes)
        answers.write(f"{json.dumps((number, answer))}\n")
        answers.flush()
    return None


def _become_a_node(name: str, server: int, answers: TextIO) -> None:
    # A session of its own keeps the terminal's Ctrl-C from the nodes, which are to be stopped in
    # order. The server's death signal keeps them from outliving whoever started it.
    os.setsid()
    die_with_parent()
    if os.getppid() != server:
        os._exit(1)  # it died before the signal was asked for
    if sys.platform == "linux":
        LIBC.prctl(PR_SET_NAME, name.encode())  # for ps, top and pkill; 15 bytes of it
    answers.close()
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, sys.stdin.fileno())
    os.close(nothing)


def _exit_code(process: int, codes: dict[int, int]) -> int | None:
    """The exit code of a process, or less than nothing and the signal; None while it runs.

    Args:
        process: The process's number.
        codes: Those of the processes that were found ended: an answer may have been missed.
    """
    if process not in codes:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            codes[process] = os.waitstatus_to_exitcode(status)
    return codes.get(process)


if __name__ == "__main__":
    sys.exit(main())
