# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap run``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import sleep
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slap_ros.bags.writer import require_new
from slap_ros.cli.console import console, print_json
from slap_ros.cli.live import Dashboard
from slap_ros.cli.options import Goal, Index, Json, Planner, Preset, Seed
from slap_ros.cli.render import check_renderable
from slap_ros.cli.render import render as write_animation
from slap_ros.cli.report import write_report
from slap_ros.cli.shortcuts import SAMPLES, Samples, Shortcuts
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.evaluation.metrics import RunMetrics
from slap_ros.messages.decode import decode_state
from slap_ros.messages.events import PlanEventKind, SkillEventKind
from slap_ros.messages.interfaces import PLAN, PLAN_EVENT, SKILL_EVENT, STATE
from slap_ros.planning.execution import MAX_REPLANS
from slap_ros.planning.planner import make_planner
from slap_ros.relational.pddl import parse_goal
from slap_ros.report import check_output
from slap_ros.robot.worlds import MOCK, ROBOT, SIM, WORLDS
from slap_ros.shortcuts.shipped import chosen_library

if TYPE_CHECKING:
    from ensemble.foxglove_server import FoxgloveServer

LOOK_S = 0.05  # s, between two looks at whether somebody watches


def run(
    domain: Annotated[str, typer.Argument(help="One of `slap domains`.")],
    seed: Seed = 0,
    index: Index = 0,
    preset: Preset = "fair",
    goal: Goal = None,
    shortcuts: Shortcuts = None,
    samples: Samples = SAMPLES,
    planner: Planner = "lazy",
    max_replans: Annotated[int, typer.Option(min=0, help="Plans after the first.")] = MAX_REPLANS,
    record: Annotated[
        Path | None, typer.Option(help="Record a bag as a new folder with this name.")
    ] = None,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="All nodes in this process.")
    ] = False,
    pace: Annotated[
        float, typer.Option(min=0.0, help="Steps a second, for watching; 0: at full speed.")
    ] = 0.0,
    timeout: Annotated[float, typer.Option(min=0.1, help="Give up after so many seconds.")] = 600.0,
    render: Annotated[
        Path | None, typer.Option(help="Write an animation of the run: a .gif or .mp4.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Tell the run on a page, as `slap report` does: a .html.")
    ] = None,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Show plan and progress in place on a terminal, and everything to Foxglove.",
        ),
    ] = False,
    live_port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help="Of the WebSocket for Foxglove. Default: 8765, or a free one."
        ),
    ] = None,
    watched: Annotated[
        bool,
        typer.Option("--watched", help="With --live: begin once somebody watches; end with them."),
    ] = False,
    world: Annotated[
        str,
        typer.Option(
            help="sim, robot (see docs/real-robot.md), or mock: a robot that is not there."
        ),
    ] = SIM,
    scene: Annotated[
        Path | None, typer.Option(help="What stands around the robot: a scene file.")
    ] = None,
    mock: Annotated[
        str, typer.Option(help="The mock robot's parameters, as latency=0.05,pose_noise=0.003.")
    ] = "",
    perception: Annotated[
        str, typer.Option(help="How well is seen, as position_noise=0.002,debounce=3.")
    ] = "",
    json: Json = False,
) -> int:
    """Run the whole ensemble on one task: simulator, perception, planner, skills, recorder."""
    # Everything that can be refused is refused before a node is started.
    check_world(world, scene, mock)
    if not live and (watched or live_port is not None):
        raise InvalidParameterError("--watched and --live-port are for --live")
    chosen = get_domain(domain, preset)
    task = chosen.task(seed, index)
    atoms = parse_goal(goal, chosen.atom_space(task.initial_state)) if goal else frozenset()
    make_planner(planner, chosen, task.initial_state)
    chosen_library(shortcuts, chosen, planner)
    if record is not None:
        require_new(record)
    if render is not None:
        check_renderable(chosen, render)
    if report is not None:
        check_output(report)

    # ROS is needed only here: every other command works without it.
    from ensemble.foxglove_server import SHOWN_TOPICS
    from ensemble.nodes import RunSettings
    from ensemble.parameters import parse_parameters
    from ensemble.perception_parameters import PerceptionParameters
    from ensemble.robot_parameters import parse_mock_robot
    from ensemble.run import RunRequest
    from ensemble.run import run as run_ensemble

    seeing = parse_parameters(perception, PerceptionParameters, "perception")
    quality = PerceptionParameters(**seeing).quality
    quality.require_known(task.initial_state.layout.by_name.keys())
    states = []
    with _bag(record, report, f"{domain}-{seed}") as bag:
        settings = RunSettings(
            domain,
            preset,
            seed,
            index,
            planner,
            bag,
            pace,
            shortcuts or "",
            samples,
            world,
            str(scene or ""),
            parse_mock_robot(mock),
            perception=seeing,
        )
        request = RunRequest(settings, atoms, 0, max_replans, timeout, in_process)
        with _broadcast(live, live_port, watched) as show, _narrator(live) as narrate:
            if show is not None:
                request = replace(request, shown=SHOWN_TOPICS)

            def follow(type_name: str, message: Any) -> None:
                narrate(type_name, message)
                if show is not None:
                    show(type_name, message)
                if type_name == STATE and render is not None:
                    states.append(message)

            metrics = run_ensemble(request, follow)
        if json:
            print_json(metrics.as_json())
        _conclude(metrics, record)
        code = write_report([bag], report) if bag is not None and report is not None else 0
    if render is not None:
        decoded = [decode_state(message, chosen.types_by_name) for message in states]
        write_animation(chosen, decoded, render)
    return int(metrics.error_code) or code


def check_world(world: str, scene: Path | None, mock: str) -> None:
    """Refuse a world that there is not, or what is meant for another one.

    Raises:
        InvalidParameterError: Says which.
    """
    if world not in WORLDS:
        raise InvalidParameterError(f"--world must be one of {', '.join(WORLDS)}, not {world!r}")
    if scene is not None and world != ROBOT:
        raise InvalidParameterError(f"--scene is what is around a robot, not for --world {world}")
    if mock and world != MOCK:
        raise InvalidParameterError(f"--mock is for --world mock, not for --world {world}")


@contextmanager
def _bag(record: Path | None, report: Path | None, name: str) -> Iterator[Path | None]:
    """Where to record: where the user wants it, or for the time that a report needs it."""
    if record is not None or report is None:
        yield record
        return
    with TemporaryDirectory(prefix="slap-") as folder:
        yield Path(folder) / name


@contextmanager
def _broadcast(live: bool, port: int | None, watched: bool) -> Iterator[FoxgloveServer | None]:
    """What shows the run to Foxglove, if it is to be shown and can be.

    Raises:
        InvalidParameterError: It was asked for explicitly, and cannot be.
    """
    from ensemble.foxglove_server import FoxgloveServer, foxglove_installed

    if not live:
        yield None
        return
    if not (foxglove_installed() or watched or port is not None):
        console.print("not shown to Foxglove: pip install 'slap_ros[live]'", markup=False)
        yield None
        return
    with FoxgloveServer(port) as show:
        console.print(f"open in Foxglove: {show.url}", highlight=False)
        while watched and not show.has_viewers:
            sleep(LOOK_S)
        yield show
        while watched and show.has_viewers:
            sleep(LOOK_S)


def _narrator(live: bool) -> AbstractContextManager[Callable[[str, Any], None]]:
    """Whoever tells the run: in place on a terminal, in lines elsewhere."""
    return Dashboard(console) if live and console.is_terminal else nullcontext(EventPrinter())


class EventPrinter:
    """Tells the run as it goes, a line for each event."""

    def __init__(self) -> None:
        self._started = 0

    def __call__(self, type_name: str, message: Any) -> None:
        """Take a message of the run."""
        if type_name == PLAN:
            steps = [f"{edge.name} {edge.predicted_steps}" for edge in message.edges]
            console.print(
                f"plan {message.number}: {message.predicted_steps} steps ({', '.join(steps)})"
            )
        elif type_name == SKILL_EVENT:
            self._skill(message)
        elif type_name == PLAN_EVENT and message.kind == PlanEventKind.DIVERGED:
            console.print(f"[yellow]diverged[/]: {message.error_msg}", highlight=False)
        elif type_name == PLAN_EVENT and message.kind == PlanEventKind.FAILED:
            console.print(f"[red]failed[/]: {message.error_msg}", highlight=False)

    def _skill(self, message: Any) -> None:
        if message.kind == SkillEventKind.STARTED:
            self._started = message.step
            return
        name = f"{message.skill}({', '.join(message.objects)})"
        outcome = SkillEventKind(message.kind).name.lower()
        steps = message.step - self._started
        console.print(f"{message.step:5d}  {name}: {outcome} after {steps} steps", highlight=False)


def _conclude(metrics: RunMetrics, record: Path | None) -> None:
    if metrics.success:
        console.print(
            f"[bold green]solved[/] in {metrics.plan_length} steps, {metrics.shortcut_steps} of "
            f"them in shortcuts, {metrics.replans} replans, "
            f"{metrics.planning_seconds:.3f} s of planning, "
            f"{metrics.edges_rolled_out} edges rolled out",
            highlight=False,
        )
    else:
        console.print(f"[bold red]not solved[/]: {metrics.error_msg}", highlight=False)
    if record is not None:
        console.print(f"bag: {record}", highlight=False)
