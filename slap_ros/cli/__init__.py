# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line ``slap``: every command but those that bring nodes up (``ensemble.cli``)."""

from __future__ import annotations

import typer

from slap_ros import __version__
from slap_ros.cli import (
    acquire,
    bag,
    check,
    domains,
    evaluate,
    plan,
    propose,
    report,
    skills,
    study,
    train,
)
from slap_ros.cli import doctor as doctor_command
from slap_ros.cli.console import exits
from slap_ros.cli.options import flat_options

app = typer.Typer(
    name="slap",
    help="Task-and-motion planning with learned shortcuts: run tasks, measure plans, look into "
    "runs.",
    epilog=(
        "Exit codes: 0 done, 2 wrong usage, 130 interrupted, 143 terminated; any other is an error "
        "code of slap_msgs/ErrorCode. With --json, stdout has JSON and nothing else."
    ),
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("plan")(exits(flat_options(plan.plan)))
app.command("propose")(exits(flat_options(propose.propose)))
app.command("evaluate")(exits(flat_options(evaluate.evaluate)))
app.command("report")(exits(report.report))
app.command("train")(exits(flat_options(train.train)))
app.command("acquire")(exits(flat_options(acquire.acquire)))
app.command("skills")(exits(skills.skills))
app.add_typer(study.app, name="study")
app.add_typer(bag.app, name="bag")
app.command("check")(exits(flat_options(check.check)))
app.command("domains")(exits(domains.domains))
app.command("doctor")(exits(doctor_command.doctor))


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"slap_ros {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: bool = typer.Option(
        False, "--version", callback=_show_version, is_eager=True, help="Show the version."
    ),
) -> None:
    del version
