# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What results say of the library that they were made with: a name and a digest, never a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from slap_ros.core import Domain
from slap_ros.shortcuts.shortcut_library import ShortcutLibrary
from slap_ros.skills.domain_choice import DIGEST_KEY, SKILLS_KEY


def describe_library(name: str, library: ShortcutLibrary) -> dict[str, Any]:
    """Which library it is: its name, the digest that bags have too, what it offers."""
    return {
        "name": name,
        "digest": library.digest,
        "shortcuts": [shortcut.name for shortcut in library.shortcuts],
    }


def describe_skills(domain: Domain) -> dict[str, Any]:
    """Which library of acquired skills a domain has; empty where it has none.

    It is told as libraries of shortcuts are, and never by the path of its folder.
    """
    digest = domain.configuration.get(DIGEST_KEY)
    if digest is None:
        return {}
    name, skills = domain.configuration[SKILLS_KEY], list(domain.skills)
    return {"name": name, "digest": digest, "skills": skills}


def both_in_words(described: Mapping[str, Any]) -> str:
    """The libraries of an evaluation in words: their names, digests and what they offer.

    Args:
        described: Descriptions of the libraries, ``skills`` and ``library``, as results have them.
    """
    skills, shortcuts = described["skills"], described["library"]
    return (
        f"skills {skills['name']} {skills['digest']}: {', '.join(skills['skills'])}\n"
        f"shortcuts {shortcuts['name']} {shortcuts['digest']}: {', '.join(shortcuts['shortcuts'])}"
    )
