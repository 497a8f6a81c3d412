# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap``: the commands of the core, and those that bring nodes up."""

from __future__ import annotations

from dataclasses import replace

from slap_ros import cli
from slap_ros.cli.lazy_commands import CommandEntry
from slap_ros.cli.streams import open_closed_streams

RUN = CommandEntry(
    "run",
    "ensemble.cli.run:run",
    "Run all nodes on one task: simulator, perception, planner, skills, recorder.",
)
WITH_REPLAY = {"bag": "ensemble.cli.replay:bag_app"}  # in the place of the core's
COMMANDS = (
    RUN,
    *(replace(one, source=WITH_REPLAY.get(one.name, one.source)) for one in cli.COMMANDS),
)

app = cli.command_app(COMMANDS)


def run() -> None:
    """Run the command that the command line states."""
    open_closed_streams()
    try:
        app()
    except OSError as error:  # commands handle their own: this is of help texts and the version
        from slap_ros.cli.console import end_without_stdout  # not above: help needs none of it

        end_without_stdout(error)
