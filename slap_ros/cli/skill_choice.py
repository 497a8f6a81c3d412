# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The option ``--skills`` of several commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from slap_ros.cli.console import warn
from slap_ros.skills.domain_choice import DomainChoice

if TYPE_CHECKING:
    from slap_ros.core import Domain

Skills = Annotated[
    str,
    typer.Option(
        help="Skills to use: a folder that `slap acquire` made, none, or demonstrator "
        "(hand-written operators and scripts that solve tasks). Default: those that ship, "
        "else the domain's own."
    ),
]


def open_chosen(domain: str, preset: str | None, skills: str) -> Domain:
    """The domain with the skills that were chosen; warns about skills that are left out.

    Args:
        domain: Name of the domain.
        preset: Preset of the domain; None for the first.
        skills: Value of ``--skills``.

    Raises:
        SlapError: There is no such domain, preset, or library.
    """
    from slap_ros.api import opening  # only where there is a domain

    return opening.open_chosen(DomainChoice(domain, preset or "", skills), warn)
