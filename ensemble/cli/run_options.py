# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options of ``slap run``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ensemble.patience import IMPATIENT, PATIENT
from slap_ros.acquisition.proposals.proposer_names import (
    MANUAL,
    PROPOSERS,
    REWARDERS,
    require_known,
)
from slap_ros.api.command_options import MAX_INDEX, DomainName, Preset, Samples, ShortcutFolder
from slap_ros.bags.writer import require_new
from slap_ros.cli.options import (
    ChosenSeed,
    EffortFactor,
    Goal,
    Index,
    Json,
    NoImprove,
    Planner,
    Within,
    at_most,
    seed_or_default,
)
from slap_ros.cli.render import Size, picture_size
from slap_ros.cli.skill_choice import Skills
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable
from slap_ros.planning.execution import MAX_REPLANS
from slap_ros.planning.planner import require_planner
from slap_ros.planning.planner_choice import DEFAULT_PLANNER, with_settings
from slap_ros.robot.worlds import FRANKA, FRANKA_SIM, MOCK, MUJOCO, ROBOT, SIM, WORLDS
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.skills.domain_choice import SHIPPED


@dataclass(frozen=True)
class RunOptions:
    """What to run, in which world, and what to keep and show of it.

    Raises:
        InvalidParameterError: Options do not fit together, or the report is no place for one.
        BagExistsError: There is something where a bag is to be recorded.
        OSError: Bag, report or animation cannot be written.
    """

    domain: DomainName
    seed: ChosenSeed = None
    index: Index = 0
    preset: Preset = None
    goal: Goal = None
    shortcuts: ShortcutFolder = None
    samples: Samples = DEFAULT.samples
    planner: Planner = DEFAULT_PLANNER
    within: Within = None
    effort: EffortFactor = None
    no_improve: NoImprove = False
    skills: Skills = SHIPPED
    max_replans: Annotated[
        int,
        typer.Option(
            min=0,
            callback=at_most(MAX_INDEX),
            help="Maximum number of plans after the first.",
        ),
    ] = MAX_REPLANS
    record: Annotated[Path | None, typer.Option(help="New folder in which to record a bag.")] = None
    in_process: Annotated[
        bool, typer.Option("--in-process", help="Run all nodes in this process.")
    ] = False
    pace: Annotated[
        float,
        typer.Option(
            min=0.0,
            callback=at_most(1e6),
            help="Steps per second, to watch a run; 0 is full speed.",
        ),
    ] = 0.0
    timeout: Annotated[
        float, typer.Option(min=0.1, callback=at_most(1e9), help="Seconds after which to give up.")
    ] = 600.0
    patience: Annotated[
        float | None,
        typer.Option(
            min=IMPATIENT,
            max=PATIENT,
            help="Factor of all deadlines except --timeout, for slow domains and machines. "
            "Default: 1, and up to 10 where the start takes longer than usual.",
        ),
    ] = None
    render: Annotated[
        Path | None, typer.Option(help=".gif or .mp4 file for an animation of the run.")
    ] = None
    size: Size = None
    report: Annotated[
        Path | None,
        typer.Option(help=".html file for a report of the run, as `slap report` writes it."),
    ] = None
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Show plan and progress on the terminal, and everything in Foxglove.",
        ),
    ] = False
    live_port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Port of the WebSocket for Foxglove. Default: 8765, or a free port.",
        ),
    ] = None
    watched: Annotated[
        bool,
        typer.Option(
            "--watched", help="With --live: wait until somebody watches, and end when nobody does."
        ),
    ] = False
    world: Annotated[
        str,
        typer.Option(
            help="World to act in: sim, robot (see docs/real-robot.md), mock (a simulated robot "
            "in the planner's own physics), mujoco (one in MuJoCo), franka (an arm by its own "
            "protocol), or franka-sim (a simulated FR3 that speaks it)."
        ),
    ] = SIM
    scene: Annotated[
        Path | None, typer.Option(help="Scene file: what stands around the robot.")
    ] = None
    robot: Annotated[
        str, typer.Option(help="Parameters of robot_bridge, such as arm=fr3,speed=0.1.")
    ] = ""
    mock: Annotated[
        str,
        typer.Option(help="Parameters of the mock robot, such as latency=0.05,pose_noise=0.003."),
    ] = ""
    mujoco: Annotated[
        str,
        typer.Option(help="Parameters of the robot in MuJoCo, such as pace=5,dropout=0.1."),
    ] = ""
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="With --world franka: solve the task in simulation, and check the arm's motion "
            "against its limits; move nothing.",
        ),
    ] = False
    yes: Annotated[
        bool, typer.Option("--yes", help="With --world franka: move the arm without asking.")
    ] = False
    acquire: Annotated[
        bool,
        typer.Option(
            "--acquire",
            help="Acquire skills where a plan or a skill is missing or fails again, and solve the "
            "task with them. --timeout must leave time for this.",
        ),
    ] = False
    grow: Annotated[
        bool,
        typer.Option(
            "--grow",
            help="Solve the task, acquire skills and learn shortcuts over them as `slap grow` "
            "does, and solve the task again with both. --timeout must leave time for this.",
        ),
    ] = False
    proposer: Annotated[
        str,
        typer.Option(
            help="With --acquire or --grow: source of operators: manual, induced or language."
        ),
    ] = MANUAL
    rewarder: Annotated[
        str,
        typer.Option(
            help="With --acquire or --grow: source of rewards: manual, composed or language."
        ),
    ] = MANUAL
    acquisition: Annotated[
        str, typer.Option(help="Parameters of acquisition_node, such as steps=20000,jobs=2.")
    ] = ""
    perception: Annotated[
        str, typer.Option(help="Noise of perception, such as position_noise=0.002,debounce=3.")
    ] = ""
    json: Json = False

    @property
    def planner_choice(self) -> str:
        """The planner with its settings."""
        improve = 0 if self.no_improve else None
        return with_settings(self.planner, self.within, self.effort, improve)

    def __post_init__(self) -> None:
        """Refuse what can be refused without the domain; see the class."""
        require_planner(self.planner_choice)
        self._check_world()
        self._check_acquisition()
        if not self.live and (self.watched or self.live_port is not None):
            raise InvalidParameterError("--watched and --live-port are for --live")
        if self.size is not None and self.render is None:
            raise InvalidParameterError("--size is for --render")
        picture_size(self.size)
        if self.record is not None:
            require_new(self.record)
            require_writable(self.record)
        if self.report is not None:
            from slap_ros.report import check_output  # few runs are reported at once

            check_output(self.report)

    def _check_world(self) -> None:
        world = self.world
        if world not in WORLDS:
            known = ", ".join(WORLDS)
            raise InvalidParameterError(f"--world must be one of {known}, not {world!r}")
        if self.scene is not None and world not in (ROBOT, MUJOCO, FRANKA):
            raise InvalidParameterError(
                f"--scene is what is around a robot, not for --world {world}"
            )
        if self.mock and world != MOCK:
            raise InvalidParameterError(f"--mock is for --world mock, not for --world {world}")
        if self.robot and world == SIM:
            raise InvalidParameterError("--robot is for a robot, not for --world sim")
        if (self.dry_run or self.yes) and world not in (FRANKA, FRANKA_SIM):
            raise InvalidParameterError(f"--dry-run and --yes are for --world franka, not {world}")
        if self.mujoco and world != MUJOCO:
            raise InvalidParameterError(f"--mujoco is for --world mujoco, not for --world {world}")

    def _check_acquisition(self) -> None:
        require_known("--proposer", self.proposer, PROPOSERS)
        require_known("--rewarder", self.rewarder, REWARDERS)
        said = self.acquisition or (self.proposer, self.rewarder) != (MANUAL, MANUAL)
        if said and not self.learns:
            raise InvalidParameterError(
                "--acquisition, --proposer and --rewarder are for --acquire and --grow"
            )
        if self.grow and (self.acquire or self.shortcuts):
            raise InvalidParameterError(
                "--grow acquires skills and learns shortcuts: leave out --acquire and --shortcuts"
            )

    @property
    def learns(self) -> bool:
        """Whether the acquisition node is to run."""
        return self.acquire or self.grow

    @property
    def task_seed(self) -> int:
        """Seed of the task."""
        return seed_or_default(self.seed)

    @property
    def foxglove_is_optional(self) -> bool:
        """Whether the run may go on without Foxglove, as nothing but ``--live`` asks for it."""
        return not self.watched and self.live_port is None
