# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slap_ros.api.command_options import Preset, Samples, ShortcutFolder
from slap_ros.cli.options import (
    ChosenSeed,
    DomainOrFile,
    EffortFactor,
    Goal,
    Index,
    Json,
    Planner,
    Within,
    say_default_seed,
    seed_or_default,
)
from slap_ros.cli.skill_choice import Skills, open_chosen
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable_folder
from slap_ros.planning.planner_choice import DEFAULT_PLANNER, with_settings
from slap_ros.shortcuts.sampling import DEFAULT
from slap_ros.skills.domain_choice import SHIPPED


def plan(
    domain: DomainOrFile,
    problem: Annotated[
        Path | None, typer.Argument(help="PDDL problem file. Give it with a PDDL domain file.")
    ] = None,
    seed: ChosenSeed = None,
    index: Index = 0,
    preset: Preset = None,
    goal: Goal = None,
    skills: Skills = SHIPPED,
    shortcuts: ShortcutFolder = None,
    samples: Samples = DEFAULT.samples,
    planner: Planner = DEFAULT_PLANNER,
    within: Within = None,
    effort: EffortFactor = None,
    output: Annotated[
        Path | None, typer.Option(help="Folder for domain.pddl, problem.pddl and graph.svg.")
    ] = None,
    json: Json = False,
) -> None:
    """Plan one task without executing it; write its PDDL and draw its abstract graph.

    A domain without skills is planned with its hand-written operators alone. Two PDDL files, or one
    that has domain and problem, are planned symbolically: with the FF heuristic (anytime, ff), for
    the least cost or the fewest operators (astar), or by an engine of unified-planning (up:NAME).
    """
    if problem is not None or domain.lower().endswith(".pddl"):
        from slap_ros.cli.plan_pddl import plan_pddl

        if within is not None:
            raise InvalidParameterError(
                "--within is not for PDDL files: --planner astar finds a plan of least cost"
            )
        _refuse_given(
            seed=seed is not None,
            index=index != 0,
            preset=preset is not None,
            goal=goal is not None,
            skills=skills != SHIPPED,
            shortcuts=shortcuts is not None,
            samples=samples != DEFAULT.samples,
            output=output is not None,
        )
        factor = 1 if effort is None else effort
        plan_pddl(Path(domain), problem or Path(domain), planner, factor, json)
        return
    # Not above: what plans symbolically needs none of it.
    from slap_ros.cli.plan_task import plan_task
    from slap_ros.core import task_with_goal

    if output is not None:
        require_writable_folder(output)
    planner = with_settings(planner, within, effort)
    chosen = open_chosen(domain, preset, skills)
    task = task_with_goal(chosen, seed_or_default(seed), index, goal)
    plan_task(chosen, task, planner, shortcuts, samples, output, json)
    say_default_seed(seed)


def _refuse_given(**given: bool) -> None:
    """Refuse options that mean nothing where a PDDL file says all: task, goal and operators.

    Raises:
        InvalidParameterError: Some are given.
    """
    if names := ", ".join(f"--{name}" for name, is_given in given.items() if is_given):
        raise InvalidParameterError(
            f"{names}: not for PDDL files, which have the task, its goal and the operators"
        )
