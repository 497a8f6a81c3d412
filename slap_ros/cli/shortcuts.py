# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which shortcuts the options of several commands choose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slap_ros.cli.console import warn

if TYPE_CHECKING:
    from slap_ros.core import Domain
    from slap_ros.shortcuts.shortcut_library import ShortcutLibrary


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
    # Only where there is a domain.
    from slap_ros.api.shortcut_choice import choose_library, shortcuts_of_option

    return choose_library(shortcuts_of_option(choice), domain, planner, warn)
