# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag``: look into bags, without ROS 2 and without the ensemble.

The ensemble adds ``slap bag replay``, which may also move a robot.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from slap_ros.api.video import require_renderable
from slap_ros.bags import (
    BagEvaluation,
    bag_info,
    evaluate_bag,
    read_bag,
    read_episodes,
    replay_bag,
)
from slap_ros.bags.ensembles import ROOT
from slap_ros.bags.export import choose_format, export_episodes, require_exportable
from slap_ros.bags.recording import Recording
from slap_ros.cli.console import console, exits, print_json, print_result, styled
from slap_ros.cli.options import Json
from slap_ros.cli.render import Size, picture_size
from slap_ros.cli.render import render as write_animation
from slap_ros.errors import DamagedBagError, ErrorCode
from slap_ros.evaluation.metrics import RunMetrics, known
from slap_ros.messages.decode import decode_state

app = typer.Typer(
    help="Look into recorded runs: list, evaluate, replay, render or export them.",
    no_args_is_help=True,
)

BagPath = Annotated[
    Path,
    typer.Argument(help="Folder of a bag, or one .mcap or .db3 file, compressed by zstd or not."),
]
Namespace = Annotated[
    str | None,
    typer.Option(
        help="Namespace of one ensemble, such as /robot1, where several were recorded. "
        "Default: all of them."
    ),
]
OneNamespace = Annotated[
    str | None,
    typer.Option(help="Namespace of the ensemble, such as /robot1, where several were recorded."),
]


@app.command("info")
@exits
def info(bag: BagPath, json: Json = False) -> int:
    """List the topics and messages of a bag."""
    found = bag_info(bag)
    if json:
        print_json(asdict(found))
    else:
        table = Table("topic", "type", "messages", title=f"{bag}, {found.duration_s:.2f} s")
        for topic in found.topics:
            table.add_row(topic.name, topic.type_name, str(topic.message_count))
        print_result(table)
        if len(found.ensembles) > 1:
            print_result(f"ensembles: {', '.join(found.ensembles)}")
        for key, value in found.metadata.items():
            print_result(f"{key}: {value}")
    return _warn(found.damage)


@app.command("evaluate")
@exits
def evaluate(bag: BagPath, namespace: Namespace = None, json: Json = False) -> int:
    """Compute every number of a run again, and the atoms of every state."""
    found = evaluate_bag(bag, namespace)
    tell = console.print if json else print_result  # what is in the JSON only as a number
    for mismatch in found.mismatches:
        tell(
            f"{_prefix(mismatch.namespace)}episode {mismatch.episode}, step {mismatch.step}: "
            f"missing {list(mismatch.missing)}, extra {list(mismatch.extra)}",
        )
    named = list(zip(found.namespaces, found.runs, strict=True))
    if json:
        runs = [run.as_json() | {"namespace": name} | _perception(found) for name, run in named]
        print_json(runs[0] if len(runs) == 1 else runs)
    else:
        for name, run in named:
            print_result(_table(name, run))
        print_result(
            f"{found.compared} of {found.states} states perceived again, "
            f"{len(found.mismatches)} mismatches"
        )
    if not found.runs:
        tell("no run: nothing was planned, or neither plans nor their events recorded")
    if found.left_out:
        topics = ", ".join(found.left_out)
        console.print(f"left out, as there are others of their types: {topics}")
    code = _warn(found.damage)
    return int(ErrorCode.REPLAY_MISMATCH) if found.mismatches else code


def _prefix(namespace: str) -> str:
    """What names an ensemble before what is said of it; nothing for one without a namespace."""
    return "" if namespace == ROOT else f"{namespace}: "


def _perception(found: BagEvaluation) -> dict[str, int | str | None]:
    return {
        "states_compared": found.compared,
        "atom_mismatches": len(found.mismatches),
        "damage": found.damage,
    }


def _table(namespace: str, run: RunMetrics) -> Table:
    table = Table(
        "option",
        "kind",
        "steps",
        "outcome",
        title=(
            f"{_prefix(namespace)}{run.domain}, preset {known(run.preset)}, "
            f"seed {known(run.seed)}: {run.outcome}\n"
            f"{known(run.plan_length)} steps, {known(run.shortcut_steps)} of them in shortcuts, "
            f"{known(run.planning_seconds, '.3f')} s planning, "
            f"{known(run.replans)} replans, {known(run.edges_rolled_out)} edges rolled out"
        ),
        caption="; ".join(f"{name}: unknown, as {why}" for name, why in run.unknown.items()),
    )
    for option in run.options:
        name = f"{option.name}({', '.join(option.objects)})"
        table.add_row(name, option.kind, str(option.steps), option.outcome)
    return table


@app.command("render")
@exits
def render(
    bag: BagPath,
    output: Annotated[Path, typer.Option(help=".gif or .mp4 file to write.")],
    size: Size = None,
    namespace: OneNamespace = None,
) -> int:
    """Write an animation of the recorded states."""
    pixels = picture_size(size)
    found = read_bag(bag)
    recording = Recording.of(found, namespace)
    domain = recording.domain()
    if domain is None:
        raise DamagedBagError(f"{bag} breaks off before it names its domain")
    messages = [m for e in recording.episodes.values() for _, m in sorted(e.states.items())]
    states = [decode_state(message, domain.types_by_name) for message in messages]
    if not states:
        raise DamagedBagError(f"{bag} has no states, so there is nothing to render")
    require_renderable(domain, states[0], output)
    write_animation(domain, states, output, pixels)
    return _warn(found.damage)


@app.command("export")
@exits
def export(
    bags: Annotated[
        list[Path],
        typer.Argument(metavar="BAG", help="Folders of bags, or single .mcap or .db3 files."),
    ],
    output: Annotated[Path, typer.Option(help="File or folder to write; it must not exist.")],
    form: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="Format: npz, csv, parquet, or lerobot (a data set for LeRobot, in a folder). "
            "Default: by the ending of --output.",
        ),
    ] = None,
    namespace: Namespace = None,
) -> None:
    """Write states, commands, atoms and rewards of every episode for numpy, pandas or LeRobot."""
    chosen = choose_format(form, output)
    require_exportable(chosen, output)
    episodes = [episode for bag in bags for episode in read_episodes(bag, namespace)]
    export_episodes(episodes, output, chosen)
    states = sum(len(episode) for episode in episodes)
    console.print(f"{chosen.name}: {output}, episodes: {len(episodes)}, states: {states}")


def replay_in_world(bag: Path, namespace: str | None, json: bool) -> int:
    """Replay a bag in a fresh world and print how it compares.

    Args:
        bag: Folder of the bag, or a single file of it.
        namespace: Namespace of an ensemble; None for all ensembles.
        json: Whether to print JSON.

    Returns:
        The exit code.
    """
    result = replay_bag(bag, namespace)
    if json:
        print_json(asdict(result) | {"identical": result.identical})
    else:
        print_result(f"{result.compared} states compared, {result.different} differ")
        if result.unreached:
            print_result(f"{result.unreached} states without the commands that lead to them")
        if result.first is not None:
            first = result.first
            print_result(
                f"first: {_prefix(first.namespace)}episode {first.episode}, step {first.step}, "
                f"{first.object}.{first.feature}: recorded {first.recorded!r}, "
                f"replayed {first.replayed!r}",
            )
    code = _warn(result.damage)
    return code if result.identical else int(ErrorCode.REPLAY_MISMATCH)


def _warn(damage: str | None) -> int:
    """Say where reading ended; the exit code."""
    if damage is None:
        return 0
    console.print(styled("damaged", "yellow", f": {damage}"))
    return int(ErrorCode.DAMAGED_BAG)
