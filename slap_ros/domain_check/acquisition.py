# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What skills are to be acquired with: metrics, goals by name, operators, rewards and scripts."""

from __future__ import annotations

from collections.abc import Iterator

from slap_ros.core import Acquisition, Domain
from slap_ros.doctor.check import Check
from slap_ros.errors import InvalidParameterError, SlapError
from slap_ros.planning.symbolic_planner import plan_symbolically
from slap_ros.relational import ground_operators
from slap_ros.skills.scripted_skill import with_scripts


def with_demonstrator(domain: Domain) -> Domain | None:
    """The domain with scripts for skills; None where there are not enough of them."""
    try:
        return with_scripts(domain)
    except InvalidParameterError:
        return None


def parts(domain: Domain, acquisition: Acquisition) -> Iterator[Check]:
    """Whether there is something to compose rewards of, and to compare what is learned with.

    Args:
        domain: Domain to check.
        acquisition: Acquisition of the domain.
    """
    yield _metrics(domain, acquisition)
    names = {operator.name for operator in acquisition.operators}
    for kind, found in (("rewards", acquisition.rewards), ("scripts", acquisition.scripts)):
        missing, unknown = sorted(names - set(found)), sorted(set(found) - names)
        if missing or unknown:
            yield Check(
                kind,
                "warning",
                "; ".join(
                    f"{word} {', '.join(listed)}"
                    for word, listed in (("none for", missing), ("unknown operators", unknown))
                    if listed
                ),
                f"Acquisition.{kind} has one by each operator's name",
            )
        else:
            yield Check(kind, "ok", f"one for each of {len(names)} hand-written operators")


def _metrics(domain: Domain, acquisition: Acquisition) -> Check:
    """Whether a reward can be composed for each operator that people wrote."""
    without = [
        operator.name
        for operator in acquisition.operators
        if not any(c.rewarded for atom in operator.add_effects for c in atom.predicate.conditions)
    ]
    if without:
        return Check(
            "metrics",
            "warning",
            f"none leads to what {', '.join(without)} add: no reward can be composed for them",
            "give conditions on metrics to the predicates of their effects: Predicate.of",
        )
    found = f"one at least leads to what each of {len(acquisition.operators)} operators adds"
    fluent = (p for p in domain.predicates if p not in domain.static_predicates)
    if alone := sorted(p.name for p in fluent if not p.conditions):
        found += f"; without any: {', '.join(alone)}"
    return Check("metrics", "ok", found)


def goals(domain: Domain, acquisition: Acquisition, seed: int) -> Check:
    """Whether hand-written operators lead to each goal by name, and none holds at the start.

    Args:
        domain: Domain to check.
        acquisition: Acquisition of the domain.
        seed: Seed of the tasks.
    """
    lengths, wrong = [], []
    for name in domain.goals:
        try:
            length = _plan_length(domain, acquisition, seed, name)
        except SlapError as error:
            wrong.append(f"{name}: {error}")
            continue
        if length:
            lengths.append(f"{name} {length}")
        else:
            wrong.append(f"{name} holds at the start of seed {seed}'s task")
    if wrong:
        advice = "a goal lies ahead, and the operators that people wrote lead there"
        return Check("goals", "problem", "; ".join(wrong), advice)
    return Check("goals", "ok", f"operators in a shortest plan: {', '.join(lengths) or 'no goals'}")


def _plan_length(domain: Domain, acquisition: Acquisition, seed: int, goal: str) -> int:
    task = domain.task(seed, goal=goal)
    space = domain.atom_space(task.initial_state)
    grounds = ground_operators(acquisition.operators, space)
    start = space.abstract(task.initial_state)
    return len(plan_symbolically(space, start, space.mask(task.goal), grounds))
