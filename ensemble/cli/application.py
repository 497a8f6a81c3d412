# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap``: the commands of the core, and those that bring nodes up."""

from __future__ import annotations

from ensemble.cli import commands
from slap_ros.cli import app
from slap_ros.cli.bag import app as bag_app
from slap_ros.cli.console import exits, open_closed_streams
from slap_ros.cli.options import flat_options

app.command("run")(exits(flat_options(commands.run)))
app.registered_commands.sort(key=lambda command: command.name != "run")  # the first in --help
bag_app.command("replay")(exits(flat_options(commands.replay)))


def run() -> None:
    """Run the command that the command line states."""
    open_closed_streams()
    app()
