# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The standard streams of a command: stdout for data alone, and both where a process has none."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import TextIO


class Stdout:
    """Stdout, which can be kept for data."""

    def __init__(self) -> None:
        self._kept: TextIO | None = None  # while it is

    @property
    def stream(self) -> TextIO:
        """Where data goes."""
        return self._kept or sys.stdout

    def write_line(self, line: str) -> None:
        """Write a line of data, at once.

        Raises:
            OSError: It cannot be written; the error says that it is stdout, and why.
        """
        try:
            self.stream.write(f"{line}\n")
            self.stream.flush()
        except OSError as error:
            discard(self.stream)
            raise OSError(error.errno, stdout_complaint(error)) from error

    @contextmanager
    def kept_for_data(self) -> Iterator[None]:
        """Send to stderr whatever else is printed on stdout meanwhile.

        A domain's own code may print, as may libraries in C, and in any process that is started.
        """
        with _moved_descriptor(sys.stdout) as self._kept, redirect_stdout(sys.stderr):
            try:
                yield
            finally:
                self._kept = None


@contextmanager
def _moved_descriptor(stream: TextIO) -> Iterator[TextIO]:
    """Another stream to the same place; the descriptor of the first becomes one of stderr.

    Processes inherit descriptors, and code in C writes to them.

    Args:
        stream: Stdout; nothing is moved where it is in memory.
    """
    number, stderr = _descriptor(stream), _descriptor(sys.stderr)
    if number is None or stderr is None:
        yield stream
        return
    stream.flush()
    kept = os.dup(number)
    os.dup2(stderr, number)
    try:
        # As on stderr: a terminal of few letters gets the others written out.
        with os.fdopen(
            kept, "w", encoding=stream.encoding, errors="backslashreplace", closefd=False
        ) as file:
            yield file
    finally:
        os.dup2(kept, number)
        os.close(kept)


def _descriptor(stream: TextIO) -> int | None:
    """The descriptor of a stream; None for one in memory."""
    try:
        return stream.fileno()
    except io.UnsupportedOperation:
        return None


def discard(stream: TextIO) -> None:
    """Let what a stream still has to write go nowhere."""
    if (number := _descriptor(stream)) is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)


def stdout_complaint(error: OSError) -> str:
    """Why stdout takes nothing, in words."""
    if error.errno == errno.EBADF:  # see open_closed_streams
        return "stdout is closed"
    return f"cannot write to stdout: {error.strerror}"


def open_closed_streams() -> None:
    """Give a process that was started without stdout or stderr something in their place.

    Python has None there, which every library trips over. What is written to a closed stdout
    fails as on any closed descriptor; what is said to a closed stderr is for nobody.
    """
    if sys.stdout is None:
        sys.stdout = os.fdopen(os.open(os.devnull, os.O_RDONLY), "w", encoding="utf-8")
    if sys.stderr is None:
        sys.stderr = os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")
