# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a command is given or meets: data stays data, and it ends with a line and a code."""

import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
import typer
from rich.table import Table
from typer.testing import CliRunner

from slap_ros.cli.console import Stderr, console, exits, print_result, styled, visible
from slap_ros.errors import ErrorCode, InvalidParameterError

HOSTILE = "[/x] [bold]b[/bold] :smile: \x1b[31mred\x07 \u202egnirts \udcff end"
SHOWN = r"[/x] [bold]b[/bold] :smile: \x1b[31mred\x07 \u202egnirts \udcff end"


def test_texts_are_neither_markup_nor_control(capsys):
    table = Table("column", title=HOSTILE)
    table.add_row(HOSTILE)
    with console.rich.capture() as capture:
        console.print(HOSTILE)
        console.print(table)
        console.print(styled("error", "bold red", f" {HOSTILE}"))
    printed = capture.get()
    assert printed.count(SHOWN) == 4
    assert not set(printed) & set("\x1b\x07\u202e\udcff")


def test_a_sentence_is_the_same_with_and_without_rich(capsys):
    stderr = Stderr()
    stderr.print(HOSTILE)
    alone = capsys.readouterr().err
    assert "rich" not in vars(stderr)
    stderr.rich.print(HOSTILE)
    assert capsys.readouterr().err == alone == f"{SHOWN}\n"


def test_a_result_is_as_plain_as_what_is_said(capsys):
    table = Table("column", title=HOSTILE)
    table.add_row(HOSTILE)
    print_result(HOSTILE)
    print_result(table)
    print_result(styled("ok", "bold green", f" {HOSTILE}"))
    printed = capsys.readouterr()
    assert printed.out.count(SHOWN) == 4 and not printed.err
    assert not set(printed.out) & set("\x1b\x07\u202e\udcff")


def test_what_can_be_seen_stays():
    assert visible("Größe 3 µm → ✓\tend\n") == "Größe 3 µm → ✓\tend\n"


def ended(error):
    """How a command ends that raises this."""
    app = typer.Typer(pretty_exceptions_enable=False)

    def command() -> int:
        raise error

    app.command()(exits(command))
    return CliRunner().invoke(app)


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (
            InvalidParameterError("no [/x]"),
            ErrorCode.INVALID_PARAMETER,
            "no [/x]",
        ),
        (MemoryError(), ErrorCode.OUT_OF_MEMORY, "out of memory"),
        (BrokenProcessPool(), ErrorCode.OUT_OF_MEMORY, "a worker was killed; short of memory?"),
        (PermissionError(13, "Permission denied", "/no/way"), ErrorCode.INPUT_OUTPUT, "/no/way"),
        (OSError(36, "File name too long", "x" * 300), ErrorCode.INPUT_OUTPUT, "(300 characters)"),
        (
            ZeroDivisionError("odd"),
            ErrorCode.INTERNAL_ERROR,
            "of slap: ZeroDivisionError in test_console.py, line",
        ),
    ],
)
def test_every_error_ends_in_one_line_and_a_code(error, code, told, monkeypatch):
    monkeypatch.delitem(sys.modules, "marbles", raising=False)  # else it may be its fault, too
    result = ended(error)
    assert result.exit_code == code
    assert told in result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_fault_of_our_own_is_kept_for_the_report():
    log = Path(ended(ZeroDivisionError("odd")).stderr.split()[-1])
    assert "ZeroDivisionError: odd" in log.read_text(encoding="utf-8")
    log.unlink()


def slap(*arguments, **options):
    command = [sys.executable, "-m", "ensemble.cli", *arguments]
    return subprocess.run(command, text=True, timeout=200, **options)


STDOUTS_THAT_TAKE_NOTHING = {
    ">/dev/full": "error cannot write to stdout: No space left on device\n",
    ">&-": "error stdout is closed\n",
    "| true": "",  # whoever read it has seen enough
}


@pytest.mark.parametrize("shell", STDOUTS_THAT_TAKE_NOTHING)
@pytest.mark.parametrize("options", ["domains obstacle2d --json", "--version", "plan --help"])
def test_a_stdout_that_takes_nothing_is_named_as_what_it_is(shell, options):
    command = f"set -o pipefail; {sys.executable} -m ensemble.cli {options} {shell}"
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=200)
    assert run.stderr == STDOUTS_THAT_TAKE_NOTHING[shell]
    assert run.returncode in (ErrorCode.INPUT_OUTPUT, 1 if shell == "| true" else None)


@pytest.mark.parametrize("shell", ["2>/dev/full", "2>&-"])
def test_a_stderr_that_takes_nothing_leaves_the_exit_code(shell):
    command = f"{sys.executable} -m ensemble.cli plan moon {shell}"
    run = subprocess.run(["sh", "-c", command], capture_output=True, text=True, timeout=200)
    assert run.returncode == ErrorCode.UNKNOWN_DOMAIN


def test_a_path_that_is_too_long_is_named_in_short():
    run = slap("bag", "info", "x" * 300, capture_output=True)
    assert run.returncode == ErrorCode.INPUT_OUTPUT
    assert "(300 characters)" in run.stderr
