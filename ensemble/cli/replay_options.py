# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options of ``slap bag replay``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from slap_ros.cli.bag import BagPath
from slap_ros.cli.options import Json
from slap_ros.errors import InvalidParameterError
from slap_ros.robot.worlds import FRANKA, FRANKA_SIM, MOCK, ROBOT

WORLD = "world"  # a fresh one, rather than a robot


@dataclass(frozen=True)
class ReplayOptions:
    """Where to replay a bag, and how.

    Raises:
        InvalidParameterError: Options do not fit together.
    """

    bag: BagPath
    to: Annotated[
        str,
        typer.Option(
            help="Where to replay: world (a new simulated one), robot (see "
            "docs/real-robot.md), franka (an arm by its own protocol, without stops), "
            "franka-sim (a simulated FR3 that speaks it), or mock (a simulated robot)."
        ),
    ] = WORLD
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Check the motion against the robot's limits; move nothing."
        ),
    ] = False
    robot: Annotated[
        str, typer.Option(help="Parameters of robot_bridge, such as arm=fr3,speed=0.1.")
    ] = ""
    mock: Annotated[
        str, typer.Option(help="Parameters of the mock robot, such as latency=0.05,pace=5.")
    ] = ""
    yes: Annotated[bool, typer.Option("--yes", help="Move the robot without asking.")] = False
    namespace: Annotated[
        str | None,
        typer.Option(
            help="Namespace of one ensemble, such as /robot1, where several were recorded. "
            "Default: all of them, one after the other; a robot executes only one."
        ),
    ] = None
    json: Json = False

    def __post_init__(self) -> None:
        """Refuse what does not fit; see the class."""
        if self.to not in (WORLD, ROBOT, MOCK, FRANKA, FRANKA_SIM):
            raise InvalidParameterError(
                f"--to must be world, robot, franka, franka-sim or mock, not {self.to!r}"
            )
        if self.to == WORLD and (self.dry_run or self.robot or self.mock):
            raise InvalidParameterError("--dry-run, --robot and --mock are for --to a robot")
        if self.mock and self.to != MOCK:
            raise InvalidParameterError("--mock is for --to mock")
