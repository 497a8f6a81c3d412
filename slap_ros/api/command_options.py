# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options of commands as plain data, and those that several rooms have.

A parameter states its option as ``Annotated[int, CommandOption("Number of tasks.", least=1)]``.
The command line makes Typer's options of that (``slap_ros.cli.options``). So a study can state its
options without importing a command line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

MAX_SEED, MAX_INDEX = 2**63 - 1, 2**32 - 1  # as messages and bags have room for them


@dataclass(frozen=True)
class CommandArgument:
    """A word of a command that has no name.

    Args:
        help: Sentence for the help page.
        complete: Function that gives the words to which a shell may complete what was typed.
    """

    help: str
    complete: Callable[[str], list[str]] | None = None


@dataclass(frozen=True)
class CommandOption:
    """An option of a command, beside the type and the default of its parameter.

    Args:
        help: Sentence for the help page.
        least: Smallest value.
        most: Largest value.
        limit: Largest value, where it is so large that help need not name it.
        metavar: Word for the value on the help page; None for the word of the type.
        name: Option on the command line, such as ``--library``; None for that of the parameter.
    """

    help: str
    least: int | None = None
    most: int | None = None
    limit: int | None = None
    metavar: str | None = None
    name: str | None = None


def matching_domains(incomplete: str) -> list[str]:
    """The domains that a shell may complete a name to."""
    from slap_ros.domains import domain_names

    return [name for name in domain_names() if name.startswith(incomplete)]


DomainName = Annotated[
    str, CommandArgument("Name of a domain; `slap domains` lists them.", matching_domains)
]
Preset = Annotated[
    str | None,
    CommandOption(
        "Preset of the domain; `slap domains` lists them. Default: the first. In our "
        "domains, fair has random tasks, and paper the start states of the paper's code."
    ),
]
Jobs = Annotated[
    int, CommandOption("Number of processes. It does not change the results.", least=1)
]
LanguageFile = Annotated[
    Path | None,
    CommandOption("JSON file of settings for the language model; see docs/language.md."),
]
ShortcutFolder = Annotated[
    str | None,
    CommandOption(
        "Folder of a shortcut library, or none. Default: the library that ships, if there is one."
    ),
]
Samples = Annotated[
    int,
    CommandOption(
        "Times that a shortcut is tried in the model; the shortest try is used.",
        least=1,
        most=10**6,
    ),
]
