# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What pushes save where a target is blocked: ``python -m benchmarks.pushed_aside [--json]``.

Nothing is learned here. For each task of Stack at Target with a cube in the way, exploration looks
for what straight pushes and random actions reach, and executes in the model the skills that lead on
from there. The shortest of these ways is what a shortcut could make of the task at first sight: a
learned one may be shorter. Picking and placing are the skills that ship; unstacking, which nobody
needs once the cube was pushed away, is a script.
"""

from __future__ import annotations

import argparse
from contextlib import suppress
from dataclasses import replace
from statistics import fmean

import numpy as np

from benchmarks.printing import show
from slap_ros.core import Domain
from slap_ros.errors import UnsolvableError
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.skills.domain_choice import DomainChoice, open_domain
from slap_ros.skills.scripted_skill import ScriptedSkill

FRESH = 500  # the seed of its tasks, as in evaluations
NODES = 3  # abstract states that are explored: the start, and what one skill leads to


def blocked_domain() -> Domain:
    """The domain with the skills that ship, and a script for the one that does not."""
    domain = open_domain(DomainChoice("stack_at_target", "fair:blocked=1"))
    assert domain.acquisition is not None
    scripts = {
        operator.name: ScriptedSkill(operator.name, domain.acquisition.scripts[operator.name])
        for operator in domain.unskilled
    }
    operators = (*domain.operators, *domain.unskilled)
    return replace(domain, operators=operators, unskilled=(), skills={**domain.skills, **scripts})


def lengths(domain: Domain, index: int) -> dict[str, float]:
    """Environment steps of a task's plan, without and with the push that saves most.

    Args:
        domain: Domain of the task.
        index: Index of the task.

    Raises:
        UnsolvableError: The task has no plan without a push.
    """
    settings = replace(training_settings("ours_near", domain).exploration, nodes=NODES, inside=0)
    explorer = Explorer.of_task(domain, FRESH, index, settings, np.random.default_rng(index))
    pushed = [c for c in explorer.explore().candidates if c.beyond]
    best = max((candidate.expected_saving for candidate in pushed), default=0.0)
    return {"skills": explorer.plan_steps, "with_push": explorer.plan_steps - best}


def measure(first: int, tasks: int) -> dict[str, dict[str, float]]:
    """A row for each task that has a plan, and one for all of them together.

    Args:
        first: Index of the first task.
        tasks: Number of tasks.
    """
    domain, rows = blocked_domain(), {}
    for index in range(first, first + tasks):
        with suppress(UnsolvableError):
            rows[f"task {index}"] = lengths(domain, index)
    skills, pushed = (fmean(row[key] for row in rows.values()) for key in ("skills", "with_push"))
    together = {"skills": skills, "with_push": pushed, "ratio": pushed / skills}
    return {**rows, f"{len(rows)} of {tasks}": together}


def main() -> None:
    """Print the figures: a row for each task, and the ratio over all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="index of the first task")
    parser.add_argument("--tasks", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    show(measure(given.first, given.tasks), given.json)


if __name__ == "__main__":
    main()
