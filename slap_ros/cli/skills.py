# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap skills``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.acquisition.proposals.inquiry import described
from slap_ros.cli.console import print_json, print_result, warn
from slap_ros.cli.operators import print_operator
from slap_ros.cli.options import Json
from slap_ros.domains import get_domain
from slap_ros.skills.operator_json import operator_data, template_data
from slap_ros.skills.skill_library import (
    AcquiredSkill,
    SkillLibrary,
    load_skill_library,
    read_library_record,
)


def skills(
    library: Annotated[Path, typer.Argument(help="Folder that `slap acquire` made.")],
    json: Json = False,
) -> None:
    """Show a library of skills: operators, rewards, success, and which skills each began from."""
    about = read_library_record(library)
    read = load_skill_library(library, get_domain(about["domain"], about.get("preset")))
    if json:
        print_json(_data(read))
        return
    for skill in read.skills:
        _show(skill)
    for reason in read.refused:
        warn(f"a skill is left out: {reason}")
    if isinstance(answered_by := about.get("answered_by"), dict):
        print_result(f"operators or rewards are {described(answered_by)}")
    progress = about.get("progress_on_fresh_tasks")
    reached = "" if progress is None else f", task progress {progress:.2f} on fresh tasks"
    made_by = " and ".join(str(about[who]) for who in ("proposer", "rewarder") if who in about)
    print_result(f"proposer and rewarder: {made_by or 'not known'}")
    print_result(f"{len(read.skills)} skills of {read.domain}, digest {read.digest}{reached}")


def _data(library: SkillLibrary) -> dict[str, Any]:
    return {
        "domain": library.domain,
        "digest": library.digest,
        "skills": [
            {
                "operator": operator_data(skill.operator),
                "reward": template_data(skill.template),
                "horizon": skill.horizon,
                **skill.record,
            }
            for skill in library.skills
        ],
        "refused": [str(reason) for reason in library.refused],
        "record": dict(library.record),
    }


def _show(skill: AcquiredSkill) -> None:
    record = skill.record
    print_operator(skill.operator, skill.template)
    if "success" not in record:
        return
    blind = record.get("vacuity") or {}
    print_result(
        f"  success {record['success']:.2f} from fresh states, of constant and random actions "
        f"{blind.get('success', float('nan')):.2f}; {record['steps']} environment steps; began "
        f"with {beginning(record.get('began_with') or {})}"
    )


def beginning(found: Mapping[str, Any]) -> str:
    """What a skill began with, in words.

    Args:
        found: Record of the beginning, as the curriculum writes it: the known skill, how similar it
            is, its share of successes before anything was learned, and those that were tried.
    """
    if "skill" not in found:
        tried = [f"{one['skill']} {one['success']:.2f}" for one in found.get("tried", ())]
        return "random weights" + (f" (success at once: {', '.join(tried)})" if tried else "")
    worth = f", success {found['success']:.2f} at once" if "success" in found else ""
    return f"{found['skill']} (similarity {found['similarity']:.2f}{worth})"
