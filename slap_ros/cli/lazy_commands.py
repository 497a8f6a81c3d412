# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands whose modules are imported when they are invoked, and not before.

Help and shell completion of ``slap`` name every command. What they say of each is in a table, so
that neither they nor any command import what other commands need.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from inspect import getdoc
from typing import Any

from typer import Typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command, get_group

from slap_ros.cli.help_pages import arrange


@dataclass(frozen=True)
class CommandEntry:
    """A command before it is imported.

    Args:
        name: Name on the command line.
        source: Where it is, as ``module:name``: a function that gives an exit code or nothing, or
            a :class:`typer.Typer` of several commands.
        help: First paragraph of its help, as the module itself has it; a test compares them.
        hidden: Whether lists of commands leave it out.
    """

    name: str
    source: str
    help: str
    hidden: bool = False

    def summary(self) -> Any:
        """A command with name and help alone, for lists of commands."""
        return TyperCommand(self.name, help=self.help, hidden=self.hidden)

    def load(self) -> Any:
        """Import the command.

        Returns:
            What Click invokes, asks for help and completes.
        """
        module, _, name = self.source.partition(":")
        found = getattr(import_module(module), name)
        command = get_group(found) if isinstance(found, Typer) else _command(self.name, found)
        command.name = self.name
        arrange(command, self.name)
        return command


def lazy_group(entries: Sequence[CommandEntry]) -> type[TyperGroup]:
    """A kind of group that has these commands and imports the one that is invoked.

    Args:
        entries: Commands, in the order in which help lists them.

    Returns:
        A class for :class:`typer.Typer`.
    """
    by_name = {entry.name: entry for entry in entries}

    class LazyGroup(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            settings["commands"] = {entry.name: entry.summary() for entry in entries}
            super().__init__(**settings)

        def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
            """The command that is named, imported: for invoking, its own help, its completion."""
            name, command, rest = super().resolve_command(ctx, args)
            return name, by_name[name].load() if name else command, rest

    return LazyGroup


def _command(name: str, function: Any) -> Any:
    # Both import more than a list of commands needs.
    from slap_ros.cli.console import exits
    from slap_ros.cli.options import flat_options

    app = Typer(add_completion=False)
    app.command(name, help=_unwrapped(function))(exits(flat_options(function)))
    return get_command(app)


def _unwrapped(function: Any) -> str:
    """What a function says of itself, a line for each paragraph: the terminal wraps them."""
    return "\n\n".join(" ".join(part.split()) for part in (getdoc(function) or "").split("\n\n"))
