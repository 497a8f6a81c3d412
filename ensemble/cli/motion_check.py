# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is shown and asked before an arm moves."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table

from ensemble.cli.run_options import RunOptions
from ensemble.parameters import parse_parameters
from ensemble.robot_parameters import GIVEN_WITH_THE_RUN, FrankaBridgeParameters
from slap_ros.api.execution import execute
from slap_ros.api.planning import plan_task
from slap_ros.api.shortcut_choice import shortcuts_of_option
from slap_ros.cli.console import console, print_json, print_result, warn
from slap_ros.core import Domain, Task
from slap_ros.errors import ErrorCode, TaskCanceledError
from slap_ros.robot.blended_run import BlendedRun
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.franka.limits import JERK, franka_limits
from slap_ros.robot.gripper import GripperAction
from slap_ros.robot.limits import Limits
from slap_ros.robot.recorded_motion import RecordedMotion, read_recorded_motion

if TYPE_CHECKING:
    from rich.console import RenderableType


def require_yes(agreed: bool) -> None:
    """Ask the person at the terminal whether the arm may move.

    Args:
        agreed: Whether the command was given ``--yes``.

    Raises:
        TaskCanceledError: There is no terminal, or the answer is not yes.
    """
    if agreed:
        return
    question = "The arm is going to move. Is everybody out of its reach?"
    if not (sys.stdin.isatty() and typer.confirm(question, err=True)):
        raise TaskCanceledError("nothing moved: it needs a yes on the terminal, or --yes")


def dry_run(options: RunOptions, domain: Domain, task: Task) -> int:
    """Solve a task in simulation, and check the arm's motion against its limits; the exit code.

    A closed loop moves from rest to rest. Blending is what a replay of the same motion has.

    Args:
        options: Options of the command.
        domain: Domain of the task.
        task: Task to solve.

    Returns:
        The exit code.

    Raises:
        SlapError: There is no plan, or the parameters of the robot are wrong.
    """
    given = parse_parameters(
        options.robot, FrankaBridgeParameters, "robot", GIVEN_WITH_THE_RUN - {"scene"}
    )
    parameters = FrankaBridgeParameters(**given)
    plan = plan_task(
        domain,
        task,
        shortcuts_of_option(options.shortcuts),
        options.planner_choice,
        options.samples,
        warn,
    )
    with TemporaryDirectory(prefix="slap-") as folder:
        run = execute(domain, task, plan, max_replans=options.max_replans)
        recorded = read_recorded_motion(run.bag(Path(folder) / "bag"))
    limits = recorded.limits_of(franka_limits(parameters.limits, parameters.speed))
    return show_check(recorded, DryRun.of(recorded, limits), parameters.arm, options.json)


def blended_run(recorded: RecordedMotion, limits: Limits, speed: float) -> BlendedRun:
    """A recording without stops, checked for a Franka arm.

    Args:
        recorded: Motion to check.
        limits: Limits of the arm at that speed.
        speed: Fraction of the largest jerk.
    """
    return BlendedRun.without_stops(recorded, limits, tuple(speed * jerk for jerk in JERK))


def tell_check(
    recorded: RecordedMotion, checked: DryRun, arm: str, tell: Callable[[RenderableType], None]
) -> None:
    """Tell a dry run to people.

    Args:
        recorded: Motion that was checked.
        checked: Dry run of the motion.
        arm: Name of the arm.
        tell: Prints a table or a sentence.
    """
    tell(_table(recorded, checked, arm))
    _tell_violations(checked, tell)


def _tell_violations(checked: DryRun, tell: Callable[[RenderableType], None]) -> None:
    for step, reason in checked.violations:
        tell(f"step {step}: {reason}")


def show_check(recorded: RecordedMotion, checked: DryRun, arm: str, as_json: bool) -> int:
    """Print a dry run as the result; the exit code of a command that does no more.

    Args:
        recorded: Motion that was checked.
        checked: Dry run of the motion.
        arm: Name of the arm.
        as_json: Whether stdout gets JSON.

    Returns:
        The exit code.
    """
    if as_json:
        print_json(as_data(recorded, checked))
        _tell_violations(checked, console.print)
    else:
        tell_check(recorded, checked, arm, print_result)
    return int(ErrorCode.UNSAFE_COMMAND) if checked.violations else 0


def as_data(recorded: RecordedMotion, checked: DryRun) -> dict[str, Any]:
    """A dry run as JSON has it."""
    return {
        "domain": recorded.domain.name,
        "seed": recorded.seed,
        "index": recorded.index,
        "steps": len(recorded.waypoints),
        "duration_s": checked.duration_s,
        "extremes": [{**asdict(extreme), "share": extreme.share} for extreme in checked.extremes],
        "violations": [{"step": step, "reason": reason} for step, reason in checked.violations],
    }


def _table(recorded: RecordedMotion, checked: DryRun, arm: str) -> Table:
    steps = len(recorded.waypoints)
    grips = sum(waypoint.gripper is not GripperAction.KEEP for waypoint in recorded.waypoints)
    verdict = (
        f"{len(checked.violations)} steps beyond its limits"
        if checked.violations
        else f"{checked.duration_s:.1f} s of motion"
    )
    period_s = recorded.domain.execution.control_period_s
    table = Table(
        "closest to a limit",
        "value",
        "allowed",
        "share",
        "step",
        title=(
            f"{recorded.domain.name}, seed {recorded.seed}, on {arm}: {steps} steps "
            f"({steps * period_s:.1f} s as recorded), {grips} grips, {verdict}"
        ),
    )
    for extreme in checked.extremes:
        style = "bold red" if extreme.share > 1.0 else None
        table.add_row(
            extreme.quantity,
            f"{extreme.value:.3f} {extreme.unit}",
            f"{extreme.low:.3f} to {extreme.high:.3f}",
            f"{extreme.share:.0%}",
            str(extreme.step),
            style=style,
        )
    return table
