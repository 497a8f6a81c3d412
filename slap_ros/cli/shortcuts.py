# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options ``--shortcuts`` and ``--samples`` of several commands."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from slap_ros.cli.console import console, styled
from slap_ros.shortcuts.shortcut import DEFAULT, Sampling

if TYPE_CHECKING:
    from slap_ros.core import Domain
    from slap_ros.shortcuts.library import Library

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


def choose(choice: str | None, domain: Domain, planner: str) -> Library | None:
    """The library to plan with, if any; warns about shortcuts that are left out.

    Args:
        choice: A library's folder, or none; None for the shipped one.
        domain: What it must fit.
        planner: Name of the planner that is to use it.

    Raises:
        InvalidLibraryError: It cannot be used as a whole.
        InvalidParameterError: The planner cannot use it.
    """
    from slap_ros.shortcuts.shipped import chosen_library  # only where there is a domain

    library = chosen_library(choice, domain, planner)
    for reason in library.refused if library is not None else ():
        console.print(styled("warning", "yellow", f" a shortcut is left out: {reason}"))
    return library


def sampling(samples: int) -> Sampling:
    """The default sampling with so many attempts."""
    return replace(DEFAULT, samples=samples)
