# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A process at the other end of a pipe; it ends when either end does.

A pool of workers would do for most, but leaves semaphores behind where it is killed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from slap_ros.errors import SlapError
from slap_ros.learning.workers import exit_with_parent
from slap_ros.signals import signals_held_back

PATIENCE_S = 5.0  # time for a process to end by itself
CLOSED = (EOFError, ConnectionError)  # raised by a pipe whose other end is closed


@contextmanager
def linked_process(serve: Callable[..., None], *arguments: Any) -> Iterator[Connection]:
    """Start a process, and end it with the context.

    Args:
        serve: Function of the process, called with its end of the pipe and the arguments;
            importable by its name. It returns when the pipe is closed. An error of ours is sent
            through the pipe.
        arguments: Further arguments of the function.

    Yields:
        This end of the pipe.
    """
    context = get_context("spawn")  # physics clients do not survive a fork
    mine, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, os.getpid(), serve, arguments))
    try:
        with signals_held_back():
            process.start()
        theirs.close()  # or nobody would notice its end
        yield mine
    finally:
        mine.close()
        if process.pid is not None:
            process.join(PATIENCE_S)
            process.kill()
            process.join()


def send(link: Connection, data: Any) -> None:
    """Send something; where the other end has ended, :func:`receive` says so."""
    with suppress(ConnectionError):
        link.send(data)


def receive(link: Connection) -> Any:
    """Wait for what the process sends.

    Raises:
        ChildProcessError: It has ended.
        SlapError: What it ended with.
    """
    try:
        answer = link.recv()
    except CLOSED as error:
        raise ChildProcessError(
            "a process that stepped worlds ended; if it was killed for memory, use fewer --jobs"
        ) from error
    if isinstance(answer, SlapError):
        raise answer
    return answer


def _serve(
    link: Connection, parent: int, serve: Callable[..., None], arguments: tuple[Any, ...]
) -> None:
    exit_with_parent(parent)
    try:
        serve(link, *arguments)
    except CLOSED:
        return
    except SlapError as error:
        link.send(error)
