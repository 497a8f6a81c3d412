# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap calibrate``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.calibration.friction import IdentifiedFriction, identify_friction
from slap_ros.calibration.pushes import read_pushes
from slap_ros.calibration.settings import calibrated_preset, parameter_file
from slap_ros.cli.console import console, print_json, print_result, warn
from slap_ros.cli.options import Json
from slap_ros.files import require_writable, write_whole


def calibrate(
    bag: Annotated[
        Path, typer.Argument(help="Folder of a bag with pushes, or one .mcap or .db3 file.")
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            help="Parameter file to write, for params_file of the launch file. Default: none."
        ),
    ] = None,
    namespace: Annotated[
        str | None,
        typer.Option(help="Namespace of the ensemble, such as /robot1, where several recorded."),
    ] = None,
    json: Json = False,
) -> None:
    """Identify friction from recorded pushes, so that the planner's model pushes alike."""
    if output is not None:
        require_writable(output)
    recorded = read_pushes(bag, namespace)
    if recorded.damage is not None:
        warn(f"{bag} is damaged: {recorded.damage}")
    found = identify_friction(recorded.domain, recorded.pushes)
    preset = calibrated_preset(recorded.domain, found)
    if output is not None:
        write_whole(output, parameter_file(recorded.domain, preset, found))
    if json:
        print_json({"domain": recorded.domain.name, "preset": preset, **asdict(found)})
        return
    print_result(_text(found))
    print_result(f"use it: slap run {recorded.domain.name} --preset {preset}")
    if output is not None:
        console.print(f"parameter file: {output}")


def _text(found: IdentifiedFriction) -> str:
    """What was found, for people."""
    return (
        f"friction {found.friction:.3f} +- {found.plus_minus:.3f}, from {found.pushes} pushes: "
        f"after each, things are {1e3 * found.rms_m:.2f} mm off (root mean square), "
        f"{1e3 * found.rms_before_m:.2f} mm with the friction that the recorded states have\n"
        f"mass cannot be told from pushes: twice of it would move things by "
        f"{1e3 * found.mass_effect_m:.2f} mm"
    )
