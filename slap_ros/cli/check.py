# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap check``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from slap_ros.api.command_options import DomainName, Preset
from slap_ros.cli.console import console, print_json, styled
from slap_ros.cli.doctor import STYLE
from slap_ros.cli.options import Json, Seed, at_most
from slap_ros.domain_check import check_domain
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode


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
    json: Json = False,
) -> int:
    """Check that a domain keeps its contract: Markov states, margins, bounds, tasks."""
    findings = []
    with console.status(f"checking {domain}") as status:
        for found in check_domain(get_domain(domain, preset), seed, tasks, states):
            findings.append(found)
            status.update(f"checking {domain}: {found.name} done")
            if not json:
                label = f"{found.status:8} "
                console.print(styled(label, STYLE[found.status], f"{found.name}: {found.found}"))
                if found.advice:
                    console.print(f"         {found.advice}")
    if json:
        print_json([asdict(found) for found in findings])
    problem = any(found.status == "problem" for found in findings)
    return int(ErrorCode.INVALID_DOMAIN) if problem else 0
