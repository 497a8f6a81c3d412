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
from slap_ros.learning.task_distribution import TaskDistribution
from slap_ros.shortcuts import jobs
from slap_ros.shortcuts.candidate_groups import rank
from slap_ros.shortcuts.exploration_result import ExplorationResult, mean_operator_steps
from slap_ros.shortcuts.named_settings import training_settings
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import DEFAULT, PAPER
from slap_ros.shortcuts.shipped import chosen_library
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.starts import Start, find_start, restore_starts
from slap_ros.skills.domain_choice import DomainChoice

FRESH = 3_000_000  # the first seed of its tasks
HORIZON, SOON = PAPER.horizon, DEFAULT.horizon  # environment steps of an attempt


def starts_of(
    shortcut: Shortcut, domain: Domain, explored: list[ExplorationResult], seed: int, count: int
) -> list[Start]:
    """Starts of a shortcut in ``count`` tasks of a seed, as training looks for them."""
    patterns = shortcut.signature.patterns
    group = next(group for group in rank(explored) if group.signature.patterns == patterns)
    steps = mean_operator_steps(explored)
    found = (
        find_start(domain, FRESH + seed, index, shortcut.signature, group.operator_path, steps)
        for index in range(count)
    )
    return restore_starts(domain, [record for record in found if record is not None])


def attempt(shortcut: Shortcut, domain: Domain, start: Start) -> int | None:
    """Steps until the shortcut succeeds; None where it fails, or reaches the horizon first."""
    encoder = ObservationEncoder(domain, start.space, shortcut.signature, start.change)
    worlds = domain.make_vector_world([start.state])
    encoding = encoder.encode(worlds.states)
    for step in range(1, HORIZON + 1):
        action = shortcut.policy.mean(encoding.observations)
        state = worlds.step(encoder.action_map(action.astype(float)))
        encoding = encoder.encode(state)
        if encoder.success(state, encoding, [start.target])[0]:
            return step
        if encoding.failure[0]:
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


def explore(name: str) -> list[ExplorationResult]:
    """The results of exploration in training, which say where a shortcut begins."""
    settings = training_settings("ours", get_domain(name)).exploration
    distribution = TaskDistribution(DomainChoice(name, "fair"), 0)
    found = (jobs.explore(distribution, index, settings) for index in range(settings.tasks))
    return [ExplorationResult.from_json(data) for data in found]


def main() -> None:
    """Print the figures: a row for each shortcut and seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain")
    parser.add_argument("--library", help="folder of a library; default: the one that ships")
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
