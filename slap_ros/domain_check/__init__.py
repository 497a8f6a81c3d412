# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Does a domain keep to the contract? What Gymnasium's ``check_env`` is for environments."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slap_ros.core import Domain
from slap_ros.doctor.check import Check
from slap_ros.domain_check import acquisition, atoms, cost, learner, markov, skills, tasks
from slap_ros.domain_check.experience import Experience, gather

__all__ = ["CHECK_SEED", "Experience", "check_domain", "gather"]

CHECK_SEED = 2_000_000  # added to the seed: neither evaluation nor training sees these tasks


def check_domain(
    domain: Domain, seed: int = 0, task_count: int = 50, state_count: int = 200
) -> Iterator[Check]:
    """Check a domain; the findings come one after the other, as soon as each is made.

    Args:
        domain: Domain to check, as its own factory makes it.
        seed: Seed of the tasks and actions.
        task_count: Number of tasks that are sampled, planned and executed.
        state_count: Number of transitions that are repeated from a reset, in random order.

    Yields:
        Findings; a *problem* makes planning, replay or learning wrong, a *warning* may.
    """
    rng = np.random.default_rng([CHECK_SEED, seed])
    yield cost.import_time(domain)
    yield tasks.different(domain, CHECK_SEED + seed, task_count)
    yield tasks.names(domain, CHECK_SEED + seed)
    yield atoms.shapes(domain, CHECK_SEED + seed)
    if domain.acquisition is not None:
        yield from acquisition.parts(domain, domain.acquisition)
        yield acquisition.goals(domain, domain.acquisition, CHECK_SEED + seed)
    solver, planner = domain, "lazy"
    if not domain.operators:  # then a demonstrator shows whether tasks can be solved
        solver, planner = acquisition.with_demonstrator(domain) or domain, "astar"
    solved = tasks.SolvedTasks.of(solver, CHECK_SEED + seed, task_count, planner)
    yield solved.check()
    start = domain.task(CHECK_SEED + seed).initial_state
    experience = gather(domain, start, solved.episodes, state_count, rng)
    yield markov.reset(domain, experience)
    yield markov.repeat(domain, experience, rng)
    yield atoms.unread(domain, experience)
    yield atoms.margins(domain, experience)
    yield atoms.thresholds(domain, CHECK_SEED + seed, task_count)
    yield skills.lower_bounds(solver, solved)
    yield skills.deterministic(solver, solved)
    if domain.learning is not None:
        yield learner.interface(domain, domain.learning.interface, experience)
    yield from cost.speed(domain, experience)
