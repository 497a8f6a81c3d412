# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes that a fork server makes: started, watched and stopped."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from itertools import count
from typing import Any, Self

from ensemble.fork_server import EXIT_CODE, RUN, die_with_parent
from slap_ros.errors import NodeDiedError

STOP_TIMEOUT = 5.0  # s, after which a node that was asked to stop is killed
POLL = 0.005  # s


class ForkServer:
    """Makes processes that have imported what nodes need. None outlives it, however it ends."""

    def __init__(self, names: Iterable[str]) -> None:
        """Begin to import nodes, in a process of their own.

        Args:
            names: The nodes' packages, such as ``sim_node``.
        """
        self._numbers = count()  # of requests
        self._process = subprocess.Popen(
            [sys.executable, "-m", "ensemble.fork_server", *names],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # keeps the terminal's Ctrl-C from it
            preexec_fn=die_with_parent,
        )

    def run(self, arguments: Sequence[str]) -> NodeProcess:
        """Run a node, once everything is imported.

        Args:
            arguments: The node's name and its ROS arguments.

        Raises:
            NodeDiedError: The server is gone.
        """
        return NodeProcess(self, self._ask(RUN, arguments))

    def exit_code(self, process: int) -> int | None:
        """How a process of it ended: once only, as its number may then be another's.

        Args:
            process: The process's number.

        Returns:
            The exit code, or less than nothing and the signal; None while it runs.
        """
        try:
            code: int | None = self._ask(EXIT_CODE, process)
        except NodeDiedError:
            return -signal.SIGKILL  # it died with the server
        return code

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.returncode is None:
            self._process.kill()
            self._process.communicate()

    def _ask(self, request: str, about: object) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        number = next(self._numbers)
        answered = -1  # Ctrl-C may have come before an answer, which is then read here
        try:
            self._process.stdin.write(f"{json.dumps((number, request, about))}\n")
            self._process.stdin.flush()
            while answered != number:
                answered, answer = json.loads(self._process.stdout.readline())
        except (BrokenPipeError, ValueError) as error:
            raise NodeDiedError("the process that starts the nodes has died") from error
        return answer


class NodeProcess:
    """A node that a fork server runs."""

    def __init__(self, server: ForkServer, number: int) -> None:
        """Refer to a process.

        Args:
            server: What made it.
            number: The process's number.
        """
        self._server = server
        self.pid = number
        self._code: int | None = None

    def poll(self) -> int | None:
        """Its exit code, or less than nothing and the signal; None while it runs."""
        if self._code is None:
            self._code = self._server.exit_code(self.pid)
        return self._code

    def terminate(self) -> None:
        """Ask it to stop."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """Stop it at once."""
        self._send(signal.SIGKILL)

    def wait(self, timeout_s: float = STOP_TIMEOUT) -> bool:
        """Wait until it has ended.

        Args:
            timeout_s: For how long at most.

        Returns:
            Whether it has.
        """
        end = time.monotonic() + timeout_s
        while self.poll() is None:
            if time.monotonic() > end:
                return False
            time.sleep(POLL)
        return True

    def _send(self, number: signal.Signals) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)
