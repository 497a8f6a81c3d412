# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap doctor``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.table import Table

from slap_ros.cli.console import console, print_json, print_result, styled
from slap_ros.cli.options import Json
from slap_ros.doctor.diagnosis import diagnose
from slap_ros.doctor.franka import examine_robot, robot_address
from slap_ros.errors import ErrorCode

STYLE = {"ok": "green", "warning": "yellow", "problem": "bold red"}


def doctor(
    robot: Annotated[
        str,
        typer.Option(
            help="Address of a Franka arm, as ip=172.16.0.2, to look at this robot instead."
        ),
    ] = "",
    json: Json = False,
) -> int:
    """Check ROS 2, DDS on this network, libraries and disk, and say what to do.

    With --robot, check a Franka arm and the way to it instead. Nothing moves.
    """
    with console.status("looking around"):
        checks = examine_robot(robot_address(robot)) if robot else diagnose()
    if json:
        print_json([asdict(check) for check in checks])
    else:
        table = Table("check", "", "found", "what to do")
        for check in checks:
            status = styled(check.status, STYLE[check.status])
            table.add_row(check.name, status, check.found, check.advice)
        print_result(table)
    problem = any(check.status == "problem" for check in checks)
    return int(ErrorCode.UNKNOWN) if problem else 0
