# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap check``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.api.command_options import DomainName, Preset
from slap_ros.cli.check_shortcuts import check_library
from slap_ros.cli.console import console, print_json, print_result, styled
from slap_ros.cli.doctor import STYLE
from slap_ros.cli.options import Json, Seed, at_most
from slap_ros.cli.skill_choice import Skills
from slap_ros.domain_check import check_domain
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.skills.domain_choice import SHIPPED


def check(
    domain: DomainName,
    preset: Preset = None,
    seed: Seed = 0,
    tasks: Annotated[
        int,
        typer.Option(min=1, callback=at_most(10**6), help="Number of tasks to plan and execute."),
    ] = 50,
    states: Annotated[
        int, typer.Option(min=10, help="Number of states to reset to and to step from again.")
    ] = 200,
    shortcuts: Annotated[
        Path | None,
        typer.Option(
            help="Folder of a shortcut library: check instead whether its shortcuts hold over "
            "--skills. If they do, this is recorded in the library."
        ),
    ] = None,
    skills: Skills = SHIPPED,
    json: Json = False,
) -> int:
    """Check that a domain keeps its contract: Markov states, margins, bounds, tasks.

    With --shortcuts, check instead whether a library of shortcuts holds over other skills.
    """
    if shortcuts is not None:
        return check_library(domain, preset, skills, shortcuts, seed, tasks, json)
    if skills != SHIPPED:
        raise InvalidParameterError("--skills is for --shortcuts: a domain is checked as it is")
    return _check_contract(domain, preset, seed, tasks, states, json)


def _check_contract(
    domain: str, preset: str | None, seed: int, tasks: int, states: int, json: bool
) -> int:
    """Check a domain, and print what was found.

    Args:
        domain: Name of the domain.
        preset: Preset of the domain; None for its first.
        seed: Seed of all random numbers.
        tasks: Number of tasks to plan and execute.
        states: Number of states to reset to and to step from again.
        json: Whether findings are printed as JSON.

    Returns:
        The exit code.
    """
    findings = []
    with console.status(f"checking {domain}") as status:
        for found in check_domain(get_domain(domain, preset), seed, tasks, states):
            findings.append(found)
            status.update(f"checking {domain}: {found.name} done")
            if not json:
                status.stop()  # both streams may be the same terminal
                label = f"{found.status:8} "
                print_result(styled(label, STYLE[found.status], f"{found.name}: {found.found}"))
                if found.advice:
                    print_result(f"         {found.advice}")
                status.start()
    if json:
        print_json([asdict(found) for found in findings])
    problem = any(found.status == "problem" for found in findings)
    return int(ErrorCode.INVALID_DOMAIN) if problem else 0
