# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which skills, libraries and goals of a domain a study is about, where its options do not say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from slap_ros.api.command_options import CommandOption
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.policies.shipped_models import shipped_with_siblings
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, chosen_skills, open_domain
from slap_ros.skills.skill_library import read_library_record

SkillLibraries = Annotated[
    list[Path] | None,
    CommandOption(
        "Folder that `slap acquire` made. May be repeated. Default: all that ship.",
        metavar="FOLDER",
        name="--library",
    ),
]
HandWrittenLibraries = Annotated[
    list[Path] | None,
    CommandOption(
        "Folder that `slap acquire` made. May be repeated. Default: all that ship with "
        "hand-written operators and rewards.",
        metavar="FOLDER",
        name="--library",
    ),
]
LibraryTasks = Annotated[int, CommandOption("Number of tasks per goal and library.", least=1)]
GoalNames = Annotated[
    list[str] | None,
    CommandOption("Name of a goal. May be repeated. Default: all goals of the domain."),
]


def all_goals(domain: Domain) -> list[str]:
    """The names of a domain's goals; where it has none, the empty one: each task's own."""
    return list(domain.goals) or [""]


def with_demonstrator(domain: str, preset: str | None) -> DomainChoice:
    """The domain with its demonstrator for skills, once it is known that there is one.

    Raises:
        SlapError: There is no such domain or preset, or no demonstrator.
    """
    choice = DomainChoice(domain, preset or "", DEMONSTRATOR)
    return replace(choice, preset=open_domain(choice).preset)


def shipped_skills(domain: str) -> list[Path]:
    """The libraries of skills that ship for a domain.

    Raises:
        InvalidParameterError: None does.
    """
    folders = shipped_with_siblings("skills", domain)
    if not folders:
        raise InvalidParameterError(
            f"no library of skills ships for {domain}; give --library, a folder that `slap acquire "
            f"{domain}` made"
        )
    return folders


def library_origin(choice: DomainChoice) -> str:
    """What made the library of a choice, and with which seed, in words.

    Args:
        choice: Domain with the skills of a library.
    """
    library = chosen_skills(choice)
    assert library is not None
    made = [str(library.record.get(name, "manual")) for name in ("proposer", "rewarder")]
    return f"{', '.join(made)}, seed {library.record.get('seed', 0)}"


def hand_written(folders: Sequence[Path]) -> list[Path]:
    """Those libraries whose operators and rewards are hand-written."""
    records = {folder: read_library_record(folder) for folder in folders}
    return [
        folder
        for folder, record in records.items()
        if (record["proposer"], record["rewarder"]) == ("manual", "manual")
    ]
