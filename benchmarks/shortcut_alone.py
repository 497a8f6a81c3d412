# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts by themselves: ``python -m benchmarks.shortcut_alone DOMAIN [--json]``.

Each shortcut of a library, run by its policy without noise from where it would begin in tasks that
neither training nor `slap evaluate` sees: one attempt, no sampling, nothing chosen.
"""

from __future__ import annotations

import argparse
from statistics import fmean

from benchmarks.printing import show
from slap_ros.core import Domain
from slap_ros.domains import get_domain
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.explore import Explored
from slap_ros.shortcuts.jobs import Place
from slap_ros.shortcuts.practice import Start
from slap_ros.shortcuts.settings import training_settings
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.shortcuts.shortcut import DEFAULT, PAPER, Shortcut
from slap_ros.shortcuts.sight import Sight
from slap_ros.shortcuts.starts import find_start, recall
from slap_ros.shortcuts.training import mean_steps, rank

FRESH = 3_000_000  # the first seed of its tasks
HORIZON, SOON = PAPER.horizon, DEFAULT.horizon  # environment steps of an attempt


def starts_of(
    shortcut: Shortcut, domain: Domain, explored: list[Explored], seed: int, count: int
) -> list[Start]:
    """Where it would begin in ``count`` tasks of a seed, as training looks for it."""
    patterns = shortcut.signature.patterns
    candidate = next(c for c in rank(explored) if c.signature.patterns == patterns)
    steps = mean_steps(explored)
    found = (
        find_start(domain, FRESH + seed, index, shortcut.signature, candidate.origin, steps)
        for index in range(count)
    )
    return recall(domain, [record for record in found if record is not None])


def attempt(shortcut: Shortcut, domain: Domain, start: Start) -> int | None:
    """Steps until it is done; None where it is lost, or not done by the horizon."""
    sight = Sight(domain, start.space, shortcut.signature, start.change)
    worlds = domain.make_vector_world([start.state])
    look = sight.look(worlds.states)
    for step in range(1, HORIZON + 1):
        choice = shortcut.policy.mean(look.observations)
        state = worlds.step(sight.actions(choice.astype(float)))
        look = sight.look(state)
        if sight.done(state, look, [start.target])[0]:
            return step
        if look.lost[0]:
            return None
    return None


def measure(shortcut: Shortcut, domain: Domain, starts: list[Start]) -> dict[str, float]:
    """How often, and in how many steps."""
    steps = [taken for start in starts if (taken := attempt(shortcut, domain, start)) is not None]
    soon = [taken for taken in steps if taken <= SOON]
    return {
        "starts": len(starts),
        "success": len(steps) / len(starts),
        "steps": fmean(steps) if steps else float("nan"),
        "success_soon": len(soon) / len(starts),
        "steps_soon": fmean(soon) if soon else float("nan"),
    }


def explore(name: str) -> list[Explored]:
    """What training found, from which it is known where a shortcut begins."""
    settings = training_settings("ours", name).exploration
    place = Place(name, "fair", 0)
    found = (jobs.explore(place, index, settings) for index in range(settings.tasks))
    return [Explored.from_json(data) for data in found]


def main() -> None:
    """Print the figures: a row for each shortcut and seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain")
    parser.add_argument("--library", help="its folder; default: the shipped one")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--starts", type=int, default=256)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    domain = get_domain(arguments.domain, "fair")
    library = chosen_library(arguments.library, domain)
    if library is None:
        parser.error(f"{domain.name} has no library")
    explored, figures = explore(domain.name), {}
    for shortcut in library.shortcuts:
        for seed in range(arguments.seeds):
            starts = starts_of(shortcut, domain, explored, seed, arguments.starts)
            figures[f"{shortcut.name} {seed}"] = measure(shortcut, domain, starts)
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
