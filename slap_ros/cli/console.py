# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages for people go to stderr, data goes to stdout."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

from slap_ros.errors import SlapError

P = ParamSpec("P")
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it
FILE_WIDTH = 120  # columns, where stderr is no terminal: tables must not be cut there

console = Console(stderr=True, soft_wrap=True, width=None if sys.stderr.isatty() else FILE_WIDTH)


def exits(command: Callable[P, int | None]) -> Callable[P, None]:
    """Turn a command's return value into its exit code, and its errors into one line and a code."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            code = command(*args, **kwargs)
        except SlapError as error:
            message = escape(" ".join(str(error).split()))
            console.print(f"[bold red]error[/] {message}", highlight=False)
            raise typer.Exit(int(error.code)) from error
        except KeyboardInterrupt:
            console.print("interrupted")
            raise typer.Exit(INTERRUPTED) from None
        raise typer.Exit(code or 0)

    return run


def print_json(data: Any) -> None:
    """Write data as one line of JSON to stdout."""
    sys.stdout.write(json.dumps(data, allow_nan=False) + "\n")
    sys.stdout.flush()


def progress() -> Progress:
    """A progress bar on stderr that goes away when it is done."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
