# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command line ``slap``: every command but those that bring nodes up (``ensemble.cli``)."""

from __future__ import annotations

from collections.abc import Sequence

import typer

from slap_ros import __version__
from slap_ros.cli.lazy_commands import CommandEntry, lazy_group

COMMANDS = (
    CommandEntry(
        "plan",
        "slap_ros.cli.plan:plan",
        "Plan one task without executing it; write its PDDL and draw its abstract graph.",
    ),
    CommandEntry(
        "propose",
        "slap_ros.cli.propose:propose",
        "Propose operators and rewards for a task, check them, and plan with them.",
    ),
    CommandEntry(
        "evaluate",
        "slap_ros.cli.evaluate:evaluate",
        "Plan and execute many tasks; print success, plan length and planning time.",
    ),
    CommandEntry(
        "report",
        "slap_ros.cli.report:report",
        "Report a run, or compare several, on one page that opens in any browser.",
    ),
    CommandEntry(
        "train",
        "slap_ros.cli.train:train",
        "Find and learn shortcuts: explore, rank, train, keep what makes plans shorter.",
    ),
    CommandEntry(
        "acquire",
        "slap_ros.cli.acquire:acquire",
        "Acquire skills: execute plans, train each skill that fails from where it fails, repeat.",
    ),
    CommandEntry(
        "acquire-sequence",
        "slap_ros.cli.acquire_sequence:acquire_sequence_command",
        "Acquire skills for one goal after another, with one library that grows.",
    ),
    CommandEntry(
        "grow",
        "slap_ros.cli.grow:grow",
        "Acquire skills, learn shortcuts over them, and again, until plans get no shorter.",
    ),
    CommandEntry(
        "skills",
        "slap_ros.cli.skills:skills",
        "Show a library of skills: operators, rewards, success, and which skills each began from.",
    ),
    CommandEntry(
        "check",
        "slap_ros.cli.check:check",
        "Check that a domain keeps its contract: Markov states, margins, bounds, tasks.",
    ),
    CommandEntry(
        "scene",
        "slap_ros.cli.scene:scene",
        "Write a scene file with AprilTags on every object, and a PDF of these tags to print.",
    ),
    CommandEntry(
        "calibrate",
        "slap_ros.cli.calibrate:calibrate",
        "Identify friction from recorded pushes, so that the planner's model pushes alike.",
    ),
    CommandEntry(
        "domains",
        "slap_ros.cli.domains:domains",
        "List the installed domains, or the predicates, metrics, goals and operators of one.",
    ),
    CommandEntry(
        "list",  # what people type first
        "slap_ros.cli.domains:domains",
        "List the installed domains, or the predicates, metrics, goals and operators of one.",
        hidden=True,
    ),
    CommandEntry(
        "doctor",
        "slap_ros.cli.doctor:doctor",
        "Check ROS 2, DDS on this network, libraries and disk, and say what to do.",
    ),
    CommandEntry(
        "baseline",
        "slap_ros.cli.baseline:app",
        "Train learners of whole tasks for comparison: PPO, SAC, SAC with hindsight, and more.",
    ),
    CommandEntry(
        "study",
        "slap_ros.cli.study:app",
        "Make a figure of the papers again: data, a picture and a page. After an interruption, "
        "the same command goes on where the study stopped.",
    ),
    CommandEntry(
        "bag",
        "slap_ros.cli.bag:app",
        "Look into recorded runs: list, evaluate, replay, render or export them.",
    ),
)


def command_app(commands: Sequence[CommandEntry]) -> typer.Typer:
    """The command line ``slap`` with these commands.

    Args:
        commands: Every command, in the order in which help lists them.

    Returns:
        The application, to be called.
    """
    app = typer.Typer(
        name="slap",
        cls=lazy_group(commands),
        help="Task-and-motion planning with learned shortcuts: run tasks, measure plans, look into "
        "runs.",
        epilog=(
            "Exit codes: 0 done, 2 wrong usage, 130 interrupted, 143 terminated; any other is an "
            "error code of slap_msgs/ErrorCode. Results go to stdout, as JSON alone with --json."
        ),
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_root)
    return app


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"slap_ros {__version__}")
        raise typer.Exit


def _root(
    version: bool = typer.Option(
        False, "--version", callback=_show_version, is_eager=True, help="Show the version."
    ),
) -> None:
    del version


app = command_app(COMMANDS)
