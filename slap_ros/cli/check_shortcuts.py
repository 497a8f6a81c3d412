# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap check --shortcuts``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from slap_ros.api.shortcut_check import ShortcutCheck, check_shortcuts
from slap_ros.cli.console import console, print_json, print_result, styled, warn
from slap_ros.cli.doctor import STYLE
from slap_ros.cli.skill_choice import open_chosen
from slap_ros.domains import get_domain
from slap_ros.errors import ErrorCode
from slap_ros.shortcuts.shortcut_library import load_library
from slap_ros.versions import CHANGED


def check_library(
    domain: str,
    preset: str | None,
    skills: str,
    library: Path,
    seed: int,
    tasks: int,
    json: bool,
) -> int:
    """Check whether the shortcuts of a library hold over skills, and print what was found.

    Args:
        domain: Name of the domain.
        preset: Preset of the domain; None for that in which the shortcuts were learned.
        skills: Choice of skills.
        library: Folder of the library.
        seed: Seed of the tasks.
        tasks: Number of tasks to plan for.
        json: Whether findings are printed as JSON.

    Returns:
        The exit code: 0 if every shortcut holds.
    """
    record = load_library(library, get_domain(domain, preset)).record
    made_by = record.get("versions")
    if isinstance(made_by, Mapping) and str(made_by.get("revision")).endswith(CHANGED):
        warn(
            f"{library} was made by {made_by['revision']}: sources with changes that were not "
            "committed, from which nobody else can make it again"
        )
    learned_in = record.get("preset")
    chosen = open_chosen(domain, preset or (str(learned_in) if learned_in else None), skills)
    with console.status(f"checking {library}") as status:
        found = check_shortcuts(
            chosen,
            library,
            tasks=tasks,
            seed=seed,
            on_task=lambda done: status.update(f"checking {library}: {done} of {tasks} tasks"),
        )
    for reason in found.library.refused:
        warn(f"a shortcut is left out: {reason}")
    if json:
        print_json({**found.as_json(), "holds": found.holds})
    else:
        _show(found, library)
    return 0 if found.holds else int(ErrorCode.SKILLS_CHANGED)


def _show(found: ShortcutCheck, library: Path) -> None:
    for trials in found.trials:
        verdict = "ok" if trials.holds else "problem"
        reached = f"reached its target from {trials.reached} of {trials.states} states"
        print_result(styled(f"{verdict:8} ", STYLE[verdict], f"{trials.name}: {reached}"))
    if found.unplanned:
        print_result(f"{found.unplanned} of {found.tasks} tasks have no plan")
    if not found.holds:
        print_result(
            f"{library} does not hold over {found.skills_in_words}. Train again over these with "
            "`slap train`; a shortcut that was tried in no state needs more --tasks"
        )
        return
    recorded = "" if found.over_own_skills else ". This is recorded in the library"
    print_result(f"{library} holds over {found.skills_in_words}{recorded}")
