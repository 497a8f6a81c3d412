# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Python in another process: for what may crash, hang or print when it is imported."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import slap_ros

PROBE = "slap_ros.doctor.probe"


@dataclass(frozen=True)
class ProcessResult:
    """How a process ended."""

    code: int | None  # None: it had to be stopped at its time limit
    output: str
    errors: str

    @property
    def last_error(self) -> str:
        """The last line of its errors, which says most."""
        if self.code is None:
            return "it did not end in time"
        lines = [line.strip() for line in self.errors.splitlines() if line.strip()]
        return lines[-1] if lines else f"it ended with exit code {self.code}"


def run_python(arguments: list[str], limit_s: float) -> ProcessResult:
    """Run this Python with arguments, for so long at most."""
    with started(arguments) as process:
        return finished(process, limit_s)


@contextmanager
def started(arguments: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that sees the same modules as this one, and that is gone afterwards.

    Its standard input stays open until then or until :func:`finished`: a process that reads it
    notices if we die.
    """
    process = subprocess.Popen(
        [sys.executable, "-P", *arguments],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(_module_path())},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,  # Ctrl-C is for us alone, and we stop it
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def finished(process: subprocess.Popen[str], limit_s: float) -> ProcessResult:
    """Close its standard input and wait for its end, for so long at most; then stop it."""
    try:
        output, errors = process.communicate(timeout=max(limit_s, 0.0))
    except subprocess.TimeoutExpired:
        process.kill()
        output, errors = process.communicate()
        return ProcessResult(None, output, errors)
    return ProcessResult(process.returncode, output, errors)


def _module_path() -> list[str]:
    """Where this process finds modules; an empty entry means its working directory."""
    ours = str(Path(slap_ros.__file__).parent.parent)
    path = [entry or str(Path.cwd()) for entry in sys.path]
    return path if ours in path else [*path, ours]
