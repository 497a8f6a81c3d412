# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a domain costs: to import, to step, to perceive, and hence to train."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter

from slap_ros.core import Domain
from slap_ros.doctor.check import Check
from slap_ros.domain_check.experience import Experience
from slap_ros.shortcuts.named_settings import training_settings

SLOW_IMPORT_S = 10.0  # the ensemble's nodes are waited for that long
SLOW_STEPS = 100.0  # environment steps a second, below which training takes hours
MEASURED = 200  # transitions that are timed


def import_time(domain: Domain) -> Check:
    """How long a new process takes until it has the domain, as each node has to."""
    code = (
        "from time import perf_counter; began = perf_counter(); "
        "from slap_ros.domains import get_domain; "
        f"get_domain({domain.name!r}, {domain.preset!r}); print(perf_counter() - began)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    if run.returncode:
        last = run.stderr.strip().splitlines()[-1:]
        return Check(
            "import",
            "problem",
            f"a new process cannot make the domain: {' '.join(last)}",
            "register it with an entry point of an installed distribution",
        )
    seconds = float(run.stdout.split()[-1])  # a domain may print as well
    return Check(
        "import",
        "warning" if seconds > SLOW_IMPORT_S else "ok",
        f"{seconds:.1f} s in a new process",
        "import what only some need where they need it" if seconds > SLOW_IMPORT_S else "",
    )


def speed(domain: Domain, experience: Experience) -> Iterator[Check]:
    """Steps, resets and abstract states a second, and what training costs at that rate."""
    transitions = experience.transitions[:MEASURED]
    layout = transitions[0].state.layout
    transitions = tuple(t for t in transitions if t.state.layout is layout)
    world = domain.make_world(transitions[0].state)
    space = domain.atom_space(transitions[0].state)
    resets = _per_second([partial(world.reset, t.state) for t in transitions])
    steps = _per_second([partial(world.step, t.action) for t in transitions])
    atoms = _per_second([partial(space.abstract, t.following) for t in transitions])
    yield Check(
        "speed",
        "warning" if steps < SLOW_STEPS else "ok",
        f"{steps:,.0f} steps, {resets:,.0f} resets, {atoms:,.0f} abstract states a second",
    )
    if domain.learning is None and domain.acquisition is not None:
        found = "no shortcuts are learned in this domain; skills are, from its metrics"
        yield Check("training", "ok", found)
        return
    settings = training_settings("ours", domain)
    wanted = settings.shortcuts * settings.total_steps
    hours = wanted / steps / 3600.0
    yield Check(
        "training",
        "ok" if domain.learning is not None else "warning",
        f"at most {wanted:,} steps: {hours:.1f} h on one core, without learning's own time"
        if domain.learning is not None
        else "there is nothing to learn from",
        "" if domain.learning is not None else "Domain.learning says what a learner observes",
    )


def _per_second(calls: list[Callable[[], object]]) -> float:
    began = perf_counter()
    for call in calls:
        call()
    return len(calls) / max(perf_counter() - began, 1e-9)
