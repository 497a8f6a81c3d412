# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which shortcut library is used: one that was chosen, or the one shipped with a domain."""

from __future__ import annotations

from pathlib import Path

from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidLibraryError, InvalidParameterError, SkillsChangedError
from slap_ros.files import parse_json, read_text
from slap_ros.planning.planner_choice import (
    DEFAULT_PLANNER,
    WITH_SHORTCUTS,
    can_use_shortcuts,
)
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.policies.library_files import ABOUT
from slap_ros.policies.shipped_models import shipped_folder, shipped_with_siblings
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary, load_library
from slap_ros.skills.domain_choice import DIGEST_KEY

NONE = "none"  # the choice of no library


def shipped_library(domain: str) -> Path | None:
    """The folder of a domain's shipped library, if there is one."""
    return shipped_folder("shortcuts", domain)


def shipped_libraries(domain: str) -> list[Path]:
    """The folders of all of a domain's shipped libraries: the one in use, and its siblings."""
    return shipped_with_siblings("shortcuts", domain)


def chosen_library(
    choice: str | None, domain: Domain, planner: str = DEFAULT_PLANNER
) -> ShortcutLibrary | None:
    """Load the library that was chosen.

    Args:
        choice: Folder of a library; or ``none``; or nothing, for the shipped library, if there is
            one over the domain's skills and the planner can use it.
        domain: Domain for which the library was learned, with the skills to plan with.
        planner: Name of the planner.

    Returns:
        The library; None to plan without shortcuts.

    Raises:
        InvalidLibraryError: It cannot be used as a whole.
        InvalidParameterError: The planner cannot use the library that was chosen.
        InvalidDomainError: Nothing can be learned in the domain, so it has no use for one.
        SkillsChangedError: The library that was chosen was learned over other skills.
    """
    library = _load_chosen(choice, domain, planner)
    if library is None or library.usable_over(skills_digest(domain)):
        return library
    if not choice:  # what ships is for other skills
        return None
    require_same_skills(library, domain, choice)
    return library


def require_same_skills(library: ShortcutLibrary, domain: Domain, where: str) -> None:
    """Refuse shortcuts that were learned over other skills, and were not found to hold over these.

    Args:
        library: Library of shortcuts.
        domain: Domain with the skills to plan with.
        where: Name of the library in the message.

    Raises:
        SkillsChangedError: They were learned over others.
    """
    if not library.usable_over(skills_digest(domain)):
        raise SkillsChangedError(
            f"{where}: its shortcuts were learned over {skills_in_words(library.skills_digest)}, "
            f"but {domain.name} has {skills_in_words(skills_digest(domain))}: give --skills as "
            "they were then, see with `slap check --shortcuts` whether they hold over these, train "
            f"again over these with `slap train`, or plan without shortcuts ({NONE})"
        )


def remark_on_skills(library: ShortcutLibrary, domain: Domain) -> str:
    """A sentence on shortcuts that were learned over other skills; empty where they were not.

    Args:
        library: Library of shortcuts that can be used in the domain.
        domain: Domain with the skills to plan with.
    """
    if library.skills_digest == skills_digest(domain):
        return ""
    return (
        f"these shortcuts were learned over {skills_in_words(library.skills_digest)}; "
        f"`slap check --shortcuts` found that they hold over "
        f"{skills_in_words(skills_digest(domain))}"
    )


def skills_digest(domain: Domain) -> str:
    """The digest of the acquired skills of a domain; empty where its skills are its own."""
    return str(domain.configuration.get(DIGEST_KEY, ""))


def skills_in_words(digest: str) -> str:
    """The skills with a digest, in words.

    Args:
        digest: Digest of a library of acquired skills; empty for a domain's own.
    """
    return f"the library of skills {digest}" if digest else "skills that were not acquired"


def _load_chosen(choice: str | None, domain: Domain, planner: str) -> ShortcutLibrary | None:
    """The library that was chosen, over whichever skills it was learned."""
    path = _chosen_path(choice, domain.name, planner)
    if path is None:
        return None
    library = load_library(path, domain)
    learner_interface(domain)
    return library


def _chosen_path(choice: str | None, domain: str, planner: str) -> Path | None:
    if choice == NONE:
        return None
    if not choice:
        return shipped_library(domain) if can_use_shortcuts(planner) else None
    if not can_use_shortcuts(planner):
        raise InvalidParameterError(
            f"the planner {planner} plans without shortcuts: leave out {choice}, or use "
            f"{' or '.join(WITH_SHORTCUTS)}"
        )
    return Path(choice)


def require_usable(choice: str, planner: str = DEFAULT_PLANNER) -> None:
    """Refuse a choice that can be seen to be wrong before the domain is known.

    Raises:
        InvalidLibraryError: See :func:`chosen_library`.
        InvalidParameterError: See :func:`chosen_library`.
        UnknownDomainError: It is a library of a domain that is not installed here.
    """
    if choice not in ("", NONE):
        _load_chosen(choice, get_domain(_domain_of(Path(choice))), planner)


def _domain_of(path: Path) -> str:
    """The name of the domain that a library says it is for."""
    try:
        return str(parse_json(read_text(path / ABOUT))["domain"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidLibraryError(
            f"{path}: no shortcut library: {ABOUT}: {error!r}; give a folder that `slap train` "
            f"made, or {NONE}"
        ) from error
