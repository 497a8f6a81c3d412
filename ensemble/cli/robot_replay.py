# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag replay --to robot``: a recorded motion checked, then executed open loop."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import Any

import typer
from rich.table import Table

from ensemble import replay as ensemble_replay
from ensemble.cli.replay_options import ReplayOptions
from ensemble.parameters import parse_parameters
from ensemble.robot_parameters import PlayerParameters, parse_mock_robot
from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console, print_json
from slap_ros.errors import ErrorCode, TaskCanceledError
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.recorded_motion import RecordedMotion, read_recorded_motion
from slap_ros.robot.robot_world import GripperAction
from slap_ros.robot.worlds import MOCK

REACHED = {
    None: "nothing was measured at the end",
    True: "the goal holds",
    False: "the goal does not hold",
}


def replay_on_robot(options: ReplayOptions) -> int:
    """Check the motion, and unless that is all, execute it; the exit code.

    Raises:
        TaskCanceledError: The person at the terminal did not let the arm move.
        SlapError: The motion must not be executed, or failed; a robot then holds.
    """
    parameters = PlayerParameters(**parse_parameters(options.robot, PlayerParameters, "robot"))
    recorded = read_recorded_motion(options.bag, options.namespace)
    checked = DryRun.of(recorded, recorded.limits_of(parameters.limits))
    if options.json and options.dry_run:
        print_json(_as_json(recorded, checked))
    else:
        console.print(_table(recorded, checked, parameters.arm))
    for step, reason in checked.violations:
        console.print(f"step {step}: {reason}")
    if options.dry_run:
        return int(ErrorCode.UNSAFE_COMMAND) if checked.violations else 0
    checked.require_safe()
    if not (options.yes or options.to == MOCK or _agreed()):
        raise TaskCanceledError("nothing moved: it needs a yes on the terminal, or --yes")
    return _execute(options, recorded, checked, parameters)


def _execute(
    options: ReplayOptions, recorded: RecordedMotion, checked: DryRun, parameters: PlayerParameters
) -> int:
    """Execute the motion; the exit code."""
    mock = parse_mock_robot(options.mock) if options.to == MOCK else None
    with counting_bars() as bar:
        watched = bar.add_task("replaying", total=len(recorded.waypoints))
        played = ensemble_replay.replay_on_robot(
            recorded, checked, parameters, mock, lambda done: bar.update(watched, completed=done)
        )
    reached = played.reached(recorded)
    if options.json:
        print_json(_as_json(recorded, checked) | {"played": played.steps, "reached": reached})
    console.print(f"{played.steps} steps executed; {REACHED[reached]}")
    return int(ErrorCode.REPLAY_MISMATCH) if reached is False else 0


def _agreed() -> bool:
    """Whether the person at the terminal lets the arm move; False without a terminal."""
    if not sys.stdin.isatty():
        return False
    return typer.confirm("The arm is going to move. Is everybody out of its reach?", err=True)


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


def _as_json(recorded: RecordedMotion, checked: DryRun) -> dict[str, Any]:
    return {
        "domain": recorded.domain.name,
        "seed": recorded.seed,
        "index": recorded.index,
        "steps": len(recorded.waypoints),
        "duration_s": checked.duration_s,
        "extremes": [{**asdict(extreme), "share": extreme.share} for extreme in checked.extremes],
        "violations": [{"step": step, "reason": reason} for step, reason in checked.violations],
    }
