# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where results go: stdout. Where everything else that is said goes: stderr. How a command ends.

The result is what a command was asked for: a plan, a table, figures, findings. What it says on the
way, warnings, and the names of files that it wrote are not.

Texts from bags, files and command lines are data: nothing in them is taken for markup, and
whatever would control the terminal is shown instead of sent.
"""

from __future__ import annotations

import errno
import json
import os
import sys
import tempfile
import traceback
import unicodedata
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from functools import cached_property, wraps
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn, ParamSpec

import typer

from slap_ros.cli.streams import Stdout, discard, stdout_complaint
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.redaction import without_secrets
from slap_ros.signals import TerminatedError, exit_code, forget_interrupt, signals_raised

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.status import Status
    from rich.text import Text

    from slap_ros.cli.plain_console import PlainConsole

P = ParamSpec("P")
# Controls, invisible formatting (it reverses the writing direction), halves of characters.
HIDDEN_CATEGORIES = ("Cc", "Cf", "Cs", "Zl", "Zp")


def visible(text: str) -> str:
    """The text with whatever does not show itself written out: an escape character as its code."""
    return "".join(
        repr(char)[1:-1]
        if unicodedata.category(char) in HIDDEN_CATEGORIES and char not in "\n\t"
        else char
        for char in text
    )


class Stderr:
    """Prints for people: sentences as they are, tables and what has style by rich.

    Importing rich takes longer than some commands. It is imported for what needs it, and from then
    on prints everything, since it may be drawing a bar that a sentence would break.
    """

    def print(self, what: RenderableType = "") -> None:
        """Print a sentence, a table, or anything else that rich can print."""
        if isinstance(what, str) and sys.stderr is not None and "rich" not in self.__dict__:
            sys.stderr.write(f"{visible(what)}\n")
            sys.stderr.flush()
        else:
            self.rich.print(what)

    def status(self, what: str) -> Status:
        """Show what is being done, while it is."""
        return self.rich.status(what)

    @cached_property
    def rich(self) -> PlainConsole:
        """For bars, and whatever else changes while it is seen."""
        from slap_ros.cli.plain_console import PlainConsole

        return PlainConsole()


console = Stderr()
_stdout = Stdout()


def styled(label: str, style: str, rest: str = "") -> Text:
    """A word with a style before a text without.

    Args:
        label: The word.
        style: Style of the word as rich names it, such as ``bold red``.
        rest: The text.

    Returns:
        Both, to be printed.
    """
    from rich.text import Text

    return Text.assemble((visible(label), style), visible(rest))


def exits(command: Callable[P, int | None]) -> Callable[P, None]:
    """Turn a command's return value into its exit code, and its errors into one line and a code."""

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            with signals_raised(), _stdout.kept_for_data():
                code = command(*args, **kwargs)
        except SlapError as error:
            _fail(error.code, " ".join(str(error).split()), error)
        except KeyboardInterrupt as error:
            forget_interrupt()
            _say("terminated" if isinstance(error, TerminatedError) else "interrupted")
            raise typer.Exit(exit_code(error)) from None
        except BrokenPipeError as error:  # whoever read stdout has seen enough
            raise typer.Exit(int(ErrorCode.INPUT_OUTPUT)) from error
        except (BrokenExecutor, ChildProcessError) as error:
            advice = "a worker was killed; short of memory? the same command goes on"
            _fail(ErrorCode.OUT_OF_MEMORY, advice, error)
        except MemoryError as error:
            advice = "out of memory; fewer jobs or tasks at once need less"
            _fail(ErrorCode.OUT_OF_MEMORY, advice, error)
        except OSError as error:
            code = ErrorCode.INPUT_OUTPUT
            if error.filename is not None and error.errno in (errno.ENOSPC, errno.EDQUOT):
                code = ErrorCode.STORAGE_FULL
            _fail(code, _os_complaint(error), error)
        except (typer.Exit, typer.Abort):
            raise
        except Exception as error:
            _fail(*_unforeseen(error), error)
        raise typer.Exit(code or 0)

    return run


def end_without_stdout(error: OSError) -> NoReturn:
    """End the process where stdout takes no help text, which no command writes."""
    discard(sys.stdout)
    _say(styled("error", "bold red", f" {stdout_complaint(error)}"))
    sys.exit(int(ErrorCode.INPUT_OUTPUT))


def _fail(code: ErrorCode, message: str, error: BaseException) -> NoReturn:
    _say(styled("error", "bold red", f" {without_secrets(message)}"))
    raise typer.Exit(int(code)) from error


def _say(text: str | Text) -> None:
    """Print on stderr; where that is closed or full, the exit code has to do."""
    try:
        console.print(text)
    except OSError:
        discard(sys.stderr)


def _os_complaint(error: OSError) -> str:
    what = error.strerror or str(error)
    path = os.fsdecode(error.filename) if isinstance(error.filename, str | bytes) else ""
    where = path if len(path) <= 120 else f"{path[:100]}… ({len(path)} characters)"
    return f"{what}: {where}; check the path, and the disk" if path else what


def _unforeseen(error: Exception) -> tuple[ErrorCode, str]:
    """Whose fault it is, and what happened, in a line; the rest is kept in a file, which is named.

    The line has no arguments of the exception: nobody foresaw it, so nobody knows what they are.
    The file has its message, without the secrets of the environment.
    """
    what, log = type(error).__name__, _kept(error)
    frames, packages = list(traceback.walk_tb(error.__traceback__)), _packages_of_domains()
    for frame, line in reversed(frames):
        package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if package in packages:
            return ErrorCode.INVALID_DOMAIN, (
                f"the domain's own code fails: {what} in {_name_of(frame)}, line {line}, of the "
                f"package {package}; the traceback is in {log}"
            )
    place = f" in {_name_of(frames[-1][0])}, line {frames[-1][1]}" if frames else ""
    used = sorted(packages & set(sys.modules))
    whose = f", or of what the package {' or '.join(used)} gives it" if used else ""
    return ErrorCode.INTERNAL_ERROR, (
        f"this is a fault of slap{whose}: {what}{place}; please report it with {log}"
    )


def _packages_of_domains() -> set[str]:
    """Packages of other distributions that register domains."""
    from slap_ros.domains.registry import registrations

    return {entry.module.partition(".")[0] for entry in registrations().entries}


def _name_of(frame: FrameType) -> str:
    """Name of the file that a frame is in."""
    return Path(frame.f_code.co_filename).name


def _kept(error: Exception) -> Path:
    """The file with an exception's traceback."""
    told = "".join(traceback.format_exception(error))
    with tempfile.NamedTemporaryFile(
        "w", prefix="slap-", suffix=".log", delete=False, encoding="utf-8", errors="replace"
    ) as log:
        log.write(without_secrets(told))
    return Path(log.name)


def warn(text: str) -> None:
    """Print a sentence as a warning."""
    console.print(styled("warning", "yellow", f" {text}"))


def print_result(what: RenderableType) -> None:
    """Print a part of the result on stdout: a sentence, a table, or whatever else rich prints."""
    if isinstance(what, str):
        _stdout.write_line(visible(what))
        return
    from slap_ros.cli.plain_console import PlainConsole

    on_stdout = PlainConsole(_stdout.stream)
    with on_stdout.capture() as printed:
        on_stdout.print(what)
    _stdout.write_line(printed.get().rstrip("\n"))


def print_json(data: Any) -> None:
    """Print data on stdout, as JSON in one line."""
    _stdout.write_line(json.dumps(data, allow_nan=False))
