# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which shortcuts are planned with: those that ship, none, a folder's, or a library at hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from slap_ros.api.left_out import Tell
from slap_ros.api.opening import SHIPPED_WORD
from slap_ros.core import Domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError
from slap_ros.planning.planner import require_planner
from slap_ros.planning.planner_choice import WITH_SHORTCUTS
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.shipped import (
    NONE,
    chosen_library,
    remark_on_skills,
    require_same_skills,
)
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.whole_numbers import require_whole

SAMPLES = DEFAULT.samples
Shortcuts = str | Path | ShortcutLibrary | None  # the word shipped, a folder, a library, or none


def choose_library(
    shortcuts: Shortcuts, domain: Domain, planner: str, tell: Tell
) -> ShortcutLibrary | None:
    """The library to plan with, if any; says which of its shortcuts are left out.

    Args:
        shortcuts: Choice of shortcuts: the word ``shipped``, a folder, a library, or None.
        domain: Domain that the shortcuts must fit.
        planner: Name of the planner that is to use them.
        tell: Function that receives warnings about shortcuts that are left out.

    Raises:
        InvalidLibraryError: The library cannot be used as a whole, or is another domain's.
        InvalidParameterError: The planner cannot use the library that was chosen.
        SkillsChangedError: The library that was chosen was learned over other skills.
    """
    if isinstance(shortcuts, ShortcutLibrary):
        library: ShortcutLibrary | None = _fitting(shortcuts, domain, planner)
    else:
        choice = NONE if shortcuts is None else str(shortcuts)
        library = chosen_library("" if choice == SHIPPED_WORD else choice, domain, planner)
    if library is not None:
        for reason in library.refused:
            tell(f"a shortcut is left out: {reason}")
        if remark := remark_on_skills(library, domain):
            tell(remark)
    return library


def shortcuts_of_option(option: str | None) -> str | None:
    """The value of ``--shortcuts`` as :func:`choose_library` has it.

    Args:
        option: Folder of a library, or the word ``none``; None for the shipped library.
    """
    return None if option == NONE else option or SHIPPED_WORD


def _fitting(library: ShortcutLibrary, domain: Domain, planner: str) -> ShortcutLibrary:
    """The library, which must be the domain's and of use to the planner."""
    if library.domain != domain.name:
        raise InvalidLibraryError(f"shortcuts of domain {library.domain!r}, not of {domain.name!r}")
    require_same_skills(library, domain, "this library")
    if require_planner(planner).name not in WITH_SHORTCUTS:
        raise InvalidParameterError(
            f"the planner {planner} plans without shortcuts: give shortcuts=None, or use "
            f"{' or '.join(WITH_SHORTCUTS)}"
        )
    return library


def sampling(samples: int) -> Sampling:
    """The default sampling with so many attempts.

    Raises:
        InvalidParameterError: There would be none, or it is no whole number.
    """
    require_whole("samples", samples, least=1)
    return replace(DEFAULT, samples=samples)
