# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag``: look into bags, without ROS 2 and without the ensemble."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from slap_ros.bags import BagEvaluation, bag_info, evaluate_bag, read_bag, replay_bag
from slap_ros.bags.recording import Recording
from slap_ros.cli.console import console, exits, print_json
from slap_ros.cli.options import Json
from slap_ros.cli.render import check_renderable
from slap_ros.cli.render import render as write_animation
from slap_ros.errors import DamagedBagError, ErrorCode, InvalidParameterError
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.messages.decode import decode_state
from slap_ros.robot.worlds import MOCK, ROBOT

SIM_WORLD = "world"

app = typer.Typer(
    help="Look into recorded runs: info, evaluate, replay, render.", no_args_is_help=True
)

BagPath = Annotated[Path, typer.Argument(help="A bag's folder, or one .mcap or .db3 file.")]


@app.command("info")
@exits
def info(bag: BagPath, json: Json = False) -> int:
    """Say what a bag holds."""
    found = bag_info(bag)
    if json:
        print_json(asdict(found))
    else:
        table = Table("topic", "type", "messages", title=f"{bag}, {found.duration_s:.2f} s")
        for topic in found.topics:
            table.add_row(topic.name, topic.type_name, str(topic.message_count))
        console.print(table)
        for key, value in found.metadata.items():
            console.print(f"{key}: {value}", highlight=False)
    return _warn(found.damage)


@app.command("evaluate")
@exits
def evaluate(bag: BagPath, json: Json = False) -> int:
    """Recompute every number of a run, and the atoms of every state."""
    found = evaluate_bag(bag)
    for mismatch in found.mismatches:
        console.print(
            f"episode {mismatch.episode}, step {mismatch.step}: "
            f"missing {list(mismatch.missing)}, extra {list(mismatch.extra)}",
            highlight=False,
            markup=False,
        )
    if json:
        runs = [run.as_json() | _perception(found) for run in found.runs]
        print_json(runs[0] if len(runs) == 1 else runs)
    else:
        for run in found.runs:
            console.print(_table(run))
        console.print(
            f"{found.compared} of {found.states} states perceived again, "
            f"{len(found.mismatches)} mismatches"
        )
    code = _warn(found.damage)
    return int(ErrorCode.REPLAY_MISMATCH) if found.mismatches else code


def _perception(found: BagEvaluation) -> dict[str, int]:
    return {"states_compared": found.compared, "atom_mismatches": len(found.mismatches)}


def _table(run: RunMetrics) -> Table:
    outcome = "solved" if run.success else f"not solved: {run.error_msg}"
    table = Table(
        "option",
        "kind",
        "steps",
        "outcome",
        title=(
            f"{run.domain}, preset {run.preset}, seed {run.seed}: {outcome}\n"
            f"{run.plan_length} steps, {run.shortcut_steps} of them in shortcuts, "
            f"{run.planning_seconds:.3f} s planning, "
            f"{run.replans} replans, {run.edges_rolled_out} edges rolled out"
        ),
    )
    for option in run.options:
        name = f"{option.name}({', '.join(option.objects)})"
        table.add_row(name, option.kind, str(option.steps), option.outcome)
    return table


@app.command("render")
@exits
def render(
    bag: BagPath,
    output: Annotated[Path, typer.Option(help="The .gif or .mp4 to write.")],
) -> int:
    """Write an animation of the recorded states."""
    found = read_bag(bag)
    recording = Recording.of(found)
    domain = recording.domain()
    if domain is None:
        raise DamagedBagError(f"{bag} breaks off before it names its domain")
    check_renderable(domain, output)
    messages = [m for e in recording.episodes.values() for _, m in sorted(e.states.items())]
    states = [decode_state(message, domain.types_by_name) for message in messages]
    write_animation(domain, states, output)
    return _warn(found.damage)


@app.command("replay")
@exits
def replay(
    bag: BagPath,
    to: Annotated[
        str, typer.Option(help="world: a fresh one; robot (see docs/real-robot.md), or mock.")
    ] = SIM_WORLD,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the motion against the robot's limits only.")
    ] = False,
    robot: Annotated[
        str, typer.Option(help="The robot's parameters, as arm=fr3,speed=0.1: robot_bridge's.")
    ] = "",
    mock: Annotated[
        str, typer.Option(help="The mock robot's parameters, as latency=0.05,pace=5.")
    ] = "",
    yes: Annotated[bool, typer.Option("--yes", help="Move the robot without asking.")] = False,
    json: Json = False,
) -> int:
    """Feed the recorded commands to a fresh world and compare every state, bit for bit.

    Or, with --to robot, execute the recorded motion on a robot, open loop: begin with --dry-run.
    """
    if to not in (SIM_WORLD, ROBOT, MOCK):
        raise InvalidParameterError(f"--to must be world, robot or mock, not {to!r}")
    if to == SIM_WORLD:
        if dry_run or robot or mock:
            raise InvalidParameterError("--dry-run, --robot and --mock are for --to robot or mock")
        return _replay_in_a_world(bag, json)
    if mock and to != MOCK:
        raise InvalidParameterError("--mock is for --to mock")
    # Bullet is needed only here: the rest of `slap bag` works without it.
    from slap_ros.cli.replay import replay_on_robot

    return replay_on_robot(bag, to, dry_run, robot, mock, yes or to == MOCK, json)


def _replay_in_a_world(bag: Path, json: bool) -> int:
    result = replay_bag(bag)
    if json:
        print_json(asdict(result) | {"identical": result.identical})
    else:
        console.print(f"{result.compared} states compared, {result.different} differ")
        if result.unreached:
            console.print(f"{result.unreached} states without the commands that lead to them")
        if result.first is not None:
            first = result.first
            console.print(
                f"first: episode {first.episode}, step {first.step}, {first.object}."
                f"{first.feature}: recorded {first.recorded!r}, replayed {first.replayed!r}",
                highlight=False,
            )
    code = _warn(result.damage)
    return code if result.identical else int(ErrorCode.REPLAY_MISMATCH)


def _warn(damage: str | None) -> int:
    """Say where reading ended; the exit code."""
    if damage is None:
        return 0
    console.print(f"[yellow]damaged[/]: {damage}", highlight=False)
    return int(ErrorCode.DAMAGED_BAG)
