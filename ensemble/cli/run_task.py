# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What ``slap run`` does: one task, from its options to its exit code."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import Any

from ensemble.cli.event_printer import EventPrinter
from ensemble.cli.live import Dashboard
from ensemble.cli.run_options import RunOptions
from ensemble.client import OnMessage
from ensemble.foxglove_server import SHOWN_TOPICS, FoxgloveServer, foxglove_installed
from ensemble.interfaces import ACQUIRE_SKILLS, ACQUISITION_EVENTS, GROW_SKILLS
from ensemble.nodes import RunSettings
from ensemble.parameters import parse_parameters
from ensemble.patience import grown_patience
from ensemble.perception_parameters import PerceptionParameters
from ensemble.robot_parameters import (
    Parameters,
    parse_franka,
    parse_mock_robot,
    parse_mujoco_robot,
    parse_robot_bridge,
    parse_servo_bridge,
)
from ensemble.run import RunRequest
from ensemble.run import run as run_ensemble
from ensemble.shortcuts import GROWN
from ensemble.skill_request import SkillRequest
from slap_ros.api.video import require_renderable
from slap_ros.cli.console import console, print_json, print_result, styled
from slap_ros.cli.options import say_default_seed
from slap_ros.cli.render import picture_size
from slap_ros.cli.render import render as write_animation
from slap_ros.cli.skill_choice import open_chosen
from slap_ros.core import Domain, Task, task_with_goal
from slap_ros.errors import ErrorCode, InvalidParameterError, NoSkillsError
from slap_ros.evaluation.metrics import RunMetrics, known
from slap_ros.messages.decode import decode_state
from slap_ros.messages.interfaces import STATE
from slap_ros.messages.protocols import StateMessage
from slap_ros.planning.planner import make_planner
from slap_ros.relational import GroundAtom
from slap_ros.robot.franka.installed import require_franky, simulator_python
from slap_ros.robot.mujoco.installed import require_mujoco
from slap_ros.robot.worlds import FRANKA, FRANKA_SIM, MUJOCO, SIM
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.skills.domain_choice import DomainChoice
from slap_ros.skills.skill import approach_of
from slap_ros.vision.installed import require_camera_libraries

LOOK_S = 0.05  # s, between two looks at whether somebody watches


def run_task(options: RunOptions) -> int:
    """Run the ensemble, show what happens, write what is asked for; the exit code.

    Raises:
        SlapError: Nothing was run, or what was run cannot be written; the code says why.
    """
    # Everything that can be refused is refused before a node is started.
    began = monotonic()
    domain = open_chosen(options.domain, options.preset, options.skills)
    imported_s = monotonic() - began
    task = task_with_goal(domain, options.task_seed, options.index, options.goal)
    request = _request(options, domain, task, imported_s)
    if options.dry_run or options.world == FRANKA:
        # An arm's motions need physics to be imported, which a plane has no use for.
        from ensemble.cli.motion_check import dry_run, require_yes

        if options.dry_run:
            return dry_run(options, domain, task)
        require_yes(options.yes)
    states: list[StateMessage] = []

    def keep_states(type_name: str, message: Any) -> None:
        if type_name == STATE and options.render is not None:
            states.append(message)

    say_default_seed(options.seed)
    with _bag(options) as bag:
        settings = replace(request.settings, record=bag)
        try:
            metrics = _run(replace(request, settings=settings), options, keep_states)
        except KeyboardInterrupt:
            if options.record is not None and options.record.exists():
                _name_bag(options.record)
            raise
        # Another run has taken the name meanwhile: the bag there is that one's.
        if metrics.error_code == ErrorCode.BAG_EXISTS:
            bag = None
        # Whoever waits for the outcome finds the files that are named; it is told without them too.
        try:
            code = _write_files(options, domain, bag, states)
        finally:
            _conclude(metrics, options.record if bag is not None else None, options.json)
    return int(metrics.error_code) or code


def _write_files(
    options: RunOptions, domain: Domain, bag: Path | None, states: Sequence[StateMessage]
) -> int:
    """Write the report and the animation that are asked for.

    Args:
        options: Options of the command.
        domain: Domain that ran.
        bag: Bag of the run; None where there is none.
        states: States of the run, for the animation.

    Returns:
        The exit code of the report.

    Raises:
        SlapError: A file cannot be written, or the bag not be read.
    """
    code = 0
    if bag is not None and options.report is not None:
        from slap_ros.cli.report import write_report

        code = write_report([bag], options.report)
    if options.render is not None:
        decoded = [decode_state(message, domain.types_by_name) for message in states]
        write_animation(domain, decoded, options.render, picture_size(options.size))
    return code


def _request(options: RunOptions, domain: Domain, task: Task, import_s: float) -> RunRequest:
    """What to ask of an ensemble, with no bag yet.

    Args:
        options: Options of the command.
        domain: Domain that runs.
        task: Task to solve.
        import_s: Seconds that the import of the domain took.

    Raises:
        SlapError: The domain, or what perceives it, cannot do what is asked for.
    """
    goal, servo = _check_planning(options, domain, task), _check_world(options, domain, task)
    bridge, franka = _robot(options, servo)
    perception = parse_parameters(options.perception, PerceptionParameters, "perception")
    quality = PerceptionParameters(**perception).quality
    quality.require_known(task.initial_state.layout.by_name.keys())
    settings = RunSettings(
        DomainChoice(options.domain, domain.preset, options.skills),
        options.task_seed,
        options.index,
        options.planner_choice,
        record=None,
        goal=options.goal or "",
        pace=options.pace,
        patience=options.patience or grown_patience(import_s),
        shortcuts=GROWN if options.grow else options.shortcuts or "",
        samples=options.samples,
        world=options.world,
        servo=servo,
        scene=str(options.scene or bridge.get("scene", "")),
        mock=parse_mock_robot(options.mock),
        mujoco=parse_mujoco_robot(options.mujoco),
        bridge=bridge,
        franka=franka,
        perception=perception,
        acquisition=_acquisition(options),
    )
    return RunRequest(
        settings,
        goal,
        max_replans=options.max_replans,
        timeout_s=options.timeout,
        import_s=import_s,
        in_process=options.in_process,
        skills=_skill_request(options),
        shown=(ACQUISITION_EVENTS,) if options.learns else (),
    )


def _skill_request(options: RunOptions) -> SkillRequest | None:
    """What is to be learned; None for nothing."""
    if not options.learns:
        return None
    training = GROW_SKILLS if options.grow else ACQUIRE_SKILLS
    return SkillRequest(options.proposer, options.rewarder, training=training)


def _robot(options: RunOptions, servo: bool) -> tuple[Parameters, Parameters]:
    """Parameters of the bridge, and of a Franka arm's driver.

    Args:
        options: Options of the command.
        servo: Whether the bridge is the one that commands a robot while it moves.

    Raises:
        InvalidParameterError: One is unknown or missing, or a library is not installed.
    """
    if servo:
        return parse_servo_bridge(options.robot), {}
    if options.world not in (FRANKA, FRANKA_SIM):
        return parse_robot_bridge(options.robot), {}
    bridge, driver = parse_franka(options.robot)
    if options.dry_run:
        return bridge, driver
    require_franky()
    if options.world == FRANKA_SIM:
        simulator_python()
        if "ip" in driver:
            raise InvalidParameterError("--world franka-sim starts its own robot: leave out ip")
    elif not driver.get("ip"):
        raise InvalidParameterError(
            "--world franka needs the robot's address: --robot ip=172.16.0.2"
        )
    return bridge, driver


def _check_world(options: RunOptions, domain: Domain, task: Task) -> bool:
    """Refuse a world in which the task cannot be carried out.

    Returns:
        Whether its robot is commanded while it moves.

    Raises:
        SlapError: The domain has no such robot, or what perceives or simulates it is missing.
    """
    if options.world == SIM:
        return False
    # Physics is needed only here: planar domains run without it.
    from slap_ros.robot.scene_config import chosen_scene_config, read_scene_config
    from slap_ros.robot.servoed_robot import is_servoed, require_servoed
    from slap_ros.robot.usable_domains import require_robot

    servo = options.world == MUJOCO and is_servoed(domain)
    if servo:
        scene = chosen_scene_config(str(options.scene or ""), domain, lambda: task.initial_state)
        require_servoed(domain, scene)
    else:
        require_robot(domain, task.initial_state)
        if options.scene is not None:
            read_scene_config(options.scene, domain)
    if options.world == MUJOCO:
        require_mujoco()
        _require_camera(options, domain)
    return servo


def _require_camera(options: RunOptions, domain: Domain) -> None:
    """Refuse a camera without libraries or tags.

    Raises:
        InvalidParameterError: A library, or the scene file, is missing.
        InvalidSceneError: The scene file is malformed, or its tags are.
    """
    if not parse_mujoco_robot(options.mujoco).get("camera"):
        return
    require_camera_libraries()
    if options.scene is None:
        which = [f"--seed {options.task_seed}"]
        which += [f"--index {options.index}"] if options.index else []
        which += [f"--preset {options.preset}"] if options.preset else []
        raise InvalidParameterError(
            f"a camera needs tags: slap scene {options.domain} {' '.join(which)} --tags FOLDER, "
            "then --scene FOLDER/scene.yaml"
        )
    from slap_ros.robot.scene_config import read_scene_config
    from slap_ros.robot.tagged_scene import placed_tags

    placed_tags(read_scene_config(options.scene, domain))


def _acquisition(options: RunOptions) -> dict[str, str | int | float] | None:
    """The parameters of the acquisition node; None where it is not to run."""
    if not options.learns:
        return None
    # What talks to models and learns takes a fifth of this command's imports.
    from ensemble.acquisition_parameters import AcquisitionParameters

    return parse_parameters(options.acquisition, AcquisitionParameters, "acquisition")


def _check_planning(options: RunOptions, domain: Domain, task: Task) -> frozenset[GroundAtom]:
    """The goal; empty for the task's own.

    Raises:
        SlapError: It is no goal of the task; or planner, library or pictures are not there.
    """
    if options.grow:
        approach_of(domain)
    elif options.shortcuts == GROWN:
        raise InvalidParameterError("shortcuts that are grown need --grow, which grows them")
    with suppress(*(NoSkillsError,) if options.learns else ()):
        make_planner(options.planner_choice, domain, task.initial_state)
    chosen_library(options.shortcuts, domain, options.planner_choice)
    if options.render is not None:
        require_renderable(domain, task.initial_state, options.render)
    return task.goal if options.goal else frozenset()


@contextmanager
def _bag(options: RunOptions) -> Iterator[Path | None]:
    """Where to record: where the user wants it, or for the time that a report needs it."""
    if options.record is not None or options.report is None:
        yield options.record
        return
    with TemporaryDirectory(prefix="slap-") as folder:
        yield Path(folder) / f"{options.domain}-{options.task_seed}"


def _run(request: RunRequest, options: RunOptions, keep_states: OnMessage) -> RunMetrics:
    """Run the ensemble and show what happens."""
    with _foxglove(options) as server, _event_view(options.live) as view:
        listeners: list[OnMessage] = [view, keep_states]
        if server is not None:
            request = replace(request, shown=SHOWN_TOPICS)  # acquisition events among them
            listeners.append(server)

        def on_message(type_name: str, message: Any) -> None:
            for listener in listeners:
                listener(type_name, message)

        return run_ensemble(request, on_message)


@contextmanager
def _foxglove(options: RunOptions) -> Iterator[FoxgloveServer | None]:
    """What shows the run to Foxglove, if it is to be shown and can be.

    Raises:
        InvalidParameterError: It was asked for explicitly, and cannot be.
    """
    if not options.live:
        yield None
        return
    if options.foxglove_is_optional and not foxglove_installed():
        console.print("not shown to Foxglove: pip install 'slap_ros[live]'")
        yield None
        return
    with FoxgloveServer(options.live_port) as server:
        console.print(f"open in Foxglove: {server.url}")
        while options.watched and not server.has_viewers:
            sleep(LOOK_S)
        yield server
        while options.watched and server.has_viewers:
            sleep(LOOK_S)


def _event_view(live: bool) -> AbstractContextManager[OnMessage]:
    """What shows the run: a view in place on a terminal, lines elsewhere."""
    if live and console.rich.is_terminal:
        return Dashboard(console.rich)
    return nullcontext(EventPrinter())


def _conclude(metrics: RunMetrics, record: Path | None, json: bool) -> None:
    if json:
        print_json(metrics.as_json())
    if metrics.success:
        tell = console.print if json else print_result  # the JSON has it too
        tell(
            styled(
                "solved",
                "bold green",
                f" in {metrics.plan_length} steps, "
                f"{known(metrics.shortcut_steps)} of them in shortcuts, "
                f"{known(metrics.replans)} replans, "
                f"{known(metrics.planning_seconds, '.3f')} s of planning, "
                f"{known(metrics.edges_rolled_out)} edges rolled out",
            )
        )
        if metrics.error_code:  # of what was asked for besides
            console.print(styled("error", "bold red", f" {metrics.error_msg}"))
    else:
        verdict = "not known whether solved" if metrics.success is None else "not solved"
        console.print(styled(verdict, "bold red", f": {metrics.error_msg}"))
    if record is not None:
        _name_bag(record)


def _name_bag(record: Path) -> None:
    console.print(f"bag: {record}")
