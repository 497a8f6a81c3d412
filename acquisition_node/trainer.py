# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Training in a process of its own: a command of slap, its events read as lines of JSON."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from tempfile import TemporaryFile
from threading import Timer
from typing import IO, Any

from ensemble.fork_server import die_with_parent
from ensemble.launcher import KNOWN_CODES
from slap_ros.errors import SlapError, TrainerDiedError, error_from
from slap_ros.signals import WORDS

STOP_TIMEOUT = 10.0  # s, after which a trainer that was asked to stop is killed
MAX_MESSAGE = 2_000  # characters of what it says last

Event = dict[str, Any]


class Trainer:
    """A process that learns. It ends with the node, however the node ends."""

    def __init__(self, command: str, arguments: Sequence[str]) -> None:
        """Run nothing yet.

        Args:
            command: Command of slap: acquire or grow.
            arguments: Command-line arguments of the command.
        """
        self._command = [sys.executable, "-m", "ensemble.cli", command, *arguments, "--events"]
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def run(self, on_event: Callable[[Event], None]) -> None:
        """Train until it is done or stopped. Takes as long as it takes: call it in a thread.

        Args:
            on_event: Called with each event.

        Raises:
            SlapError: Training failed; the error has the command's own code.
            TrainerDiedError: It was killed, or ended as no command does.
        """
        with TemporaryFile() as said:
            # The thread that starts it lives as long as the node does: see `die_with_parent`.
            with subprocess.Popen(
                self._command,
                stdout=subprocess.PIPE,
                stderr=said,
                start_new_session=True,
                preexec_fn=die_with_parent,
            ) as process:
                self._process = process
                if self._stopped:  # before it began
                    process.terminate()
                assert process.stdout is not None
                for line in process.stdout:
                    if (event := _event(line)) is not None:
                        on_event(event)
            self._process = None
            if process.returncode and not self._stopped:
                raise _failure(process.returncode, _end_of(said))

    def stop(self) -> None:
        """Ask the process to end; returns at once. What it has learned is on disk."""
        self._stopped = True
        process = self._process
        if process is not None:
            process.terminate()
            timer = Timer(STOP_TIMEOUT, process.kill)
            timer.daemon = True
            timer.start()


def _event(line: bytes) -> Event | None:
    """The event in a line; None where it has none, as one that a killed process has cut."""
    try:
        event = json.loads(line)
    except ValueError:
        return None
    return event if isinstance(event, dict) and "event" in event else None


def _end_of(said: IO[bytes]) -> str:
    """The last line on stderr."""
    size = said.seek(0, 2)
    said.seek(max(0, size - MAX_MESSAGE))
    lines = said.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it said nothing"


def _failure(code: int, said: str) -> SlapError:
    if code in KNOWN_CODES and said not in WORDS.values():
        return error_from(code, said.removeprefix("error "))
    how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    return TrainerDiedError(
        f"the training process {how} ({said}); what it learned is kept, and the same goal goes on"
    )
