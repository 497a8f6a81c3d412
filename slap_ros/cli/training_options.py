# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options that ``slap train``, ``slap acquire`` and ``slap grow`` have in common."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slap_ros.api.command_options import MAX_SEED, CommandOption

TrainingSeed = Annotated[int, CommandOption("Seed of all random numbers.", least=0, limit=MAX_SEED)]
Ray = Annotated[
    str | None, CommandOption("Run on Ray instead of in processes: a cluster's address, or local.")
]
WorkFolder = Annotated[
    Path | None,
    CommandOption(
        "Folder for checkpoints and results. With the same folder again, training goes on."
    ),
]

Rewarder = Annotated[
    str,
    CommandOption(
        "Source of rewards: manual (hand-written), composed (from metrics), or language (from a "
        "language model)."
    ),
]
BeginWith = Annotated[
    list[Path] | None,
    typer.Option(
        "--from", help="Skill library whose skills training may begin from. May be repeated."
    ),
]
Events = Annotated[
    bool, typer.Option("--events", help="Print every event on stdout, as one line of JSON.")
]


def setting_changes(example: str) -> CommandOption:
    """The option ``--set``.

    Args:
        example: Change of a setting that the training has.
    """
    return CommandOption(
        f"Change one of the settings, such as {example}. May be repeated. A wrong name lists all "
        "names.",
        metavar="NAME=VALUE",
    )


def new_library(room: Path) -> CommandOption:
    """The option ``--output``.

    Args:
        room: Folder in which new libraries are by default, each in a folder of its domain's name.
    """
    return CommandOption(f"Folder of the new library. Default: {room}/DOMAIN.")
