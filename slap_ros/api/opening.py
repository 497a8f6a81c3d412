# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Opening a domain: its preset, its settings, and whose skills it has."""

from __future__ import annotations

from pathlib import Path

from slap_ros.api.argument_kinds import checks_arguments
from slap_ros.api.left_out import Tell, warn_caller
from slap_ros.core import Domain
from slap_ros.domains import domain_names, preset_names
from slap_ros.skills.domain_choice import (
    NO_SKILLS,
    SHIPPED,
    DomainChoice,
    chosen_skills,
    open_domain,
)

SHIPPED_WORD = "shipped"  # for what ships with a domain, of skills as of shortcuts
SettingText = str | int | float | tuple[float, float]


def domains() -> list[str]:
    """Names of all domains that are installed: ours first, then those of other distributions.

    ``slap domains`` shows their presets, and what each of them has.
    """
    return domain_names()


@checks_arguments
def make(
    name: str,
    preset: str | None = None,
    skills: str | Path | None = "shipped",
    **settings: SettingText,
) -> Domain:
    """Make a domain.

    Args:
        name: Name of the domain, one of :func:`domains`.
        preset: Name of a preset, maybe with settings, as ``fair:obstacles=4``; None for the
            domain's first.
        skills: Choice of the skills: ``shipped`` for those that ship, or else the domain's own;
            None for no skills; ``demonstrator`` for hand-written operators with scripts; or the
            folder of a library that :func:`acquire` made.
        settings: Settings of the preset to change, as ``obstacles=4``; a range is a pair, as
            ``mass=(0.8, 1.2)``.

    Returns:
        The domain.

    Raises:
        UnknownDomainError: There is no such domain.
        InvalidParameterError: There is no such preset, no such setting, or no such skills.
        InvalidDomainError: The domain's own code fails.
        InvalidLibraryError: The folder has no library of this domain that can be read.
    """
    choice = DomainChoice(name, _with_settings(name, preset, settings), _skills(skills))
    return open_chosen(choice, warn_caller)


def open_chosen(choice: DomainChoice, tell: Tell) -> Domain:
    """The domain that is meant; says which skills of its library are left out.

    Raises:
        SlapError: There is no such domain, preset, or library.
    """
    library = chosen_skills(choice)
    for reason in library.refused if library is not None else ():
        tell(f"a skill is left out: {reason}")
    return open_domain(choice)


def _with_settings(name: str, preset: str | None, settings: dict[str, SettingText]) -> str:
    """The preset as the command line has it."""
    if not settings:
        return preset or ""
    chosen = preset or preset_names(name)[0]
    changes = ",".join(f"{key}={_as_text(value)}" for key, value in settings.items())
    return f"{chosen}{',' if ':' in chosen else ':'}{changes}"


def _as_text(value: SettingText) -> str:
    return "..".join(map(str, value)) if isinstance(value, tuple | list) else str(value)


def _skills(skills: str | Path | None) -> str:
    """The skills as :class:`DomainChoice` has them."""
    if skills is None:
        return NO_SKILLS
    return SHIPPED if skills == SHIPPED_WORD else str(skills)
