# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options that the commands of several studies have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Protocol

from slap_ros.api.command_options import MAX_SEED, CommandOption

RESULTS = Path("docs/results")
FRESH_SEED = 500  # development looks at no task seed from here on

Tasks = Annotated[int, CommandOption("Tasks per seed.", least=1)]
Seeds = Annotated[int, CommandOption("Number of task seeds.", least=1)]
FirstSeed = Annotated[int, CommandOption("First task seed.", least=0)]
FreshSeed = Annotated[int, CommandOption("Seed of the tasks.", least=0, limit=MAX_SEED)]
Libraries = Annotated[
    list[Path] | None,
    CommandOption(
        "Folder of a library, one per training seed. May be repeated. Default: all that ship.",
        metavar="FOLDER",
        name="--library",
    ),
]
Output = Annotated[Path, CommandOption("Folder for the files STUDY_DOMAIN.json, .svg and .md.")]


class StudyOptions(Protocol):
    """The options that every study has."""

    @property
    def domain(self) -> str:
        """Name of the domain."""
        ...

    @property
    def jobs(self) -> int:
        """Number of processes."""
        ...

    @property
    def output(self) -> Path:
        """Folder for the files of the report."""
        ...
