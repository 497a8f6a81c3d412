# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options ``--shortcuts`` and ``--samples`` of several commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from slap_ros.cli.console import warn
from slap_ros.shortcuts.shortcut import DEFAULT

if TYPE_CHECKING:
    from slap_ros.core import Domain
    from slap_ros.shortcuts.shortcut_library import ShortcutLibrary

SAMPLES = DEFAULT.samples

Shortcuts = Annotated[
    str | None,
    typer.Option(
        help="Folder of a shortcut library, or none. Default: the library that ships, if "
        "there is one."
    ),
]
Samples = Annotated[
    int,
    typer.Option(
        min=1,
        max=10**6,
        help="Times that a shortcut is tried in the model; the shortest try is used.",
    ),
]


def choose(choice: str | None, domain: Domain, planner: str) -> ShortcutLibrary | None:
    """The library to plan with, if any; warns about shortcuts that are left out.

    Args:
        choice: A library's folder, or none; None for the shipped one.
        domain: What it must fit.
        planner: Name of the planner that is to use it.

    Raises:
        InvalidLibraryError: It cannot be used as a whole.
        InvalidParameterError: The planner cannot use it.
    """
    from slap_ros.api.shortcut_choice import choose_library  # only where there is a domain

    return choose_library(wanted(choice), domain, planner, warn)


def wanted(choice: str | None) -> str | None:
    """The option's value as the Python API has it: ``shipped``, a folder, or None for none."""
    from slap_ros.api.opening import SHIPPED_WORD
    from slap_ros.shortcuts.shipped import NONE

    return None if choice == NONE else choice or SHIPPED_WORD
