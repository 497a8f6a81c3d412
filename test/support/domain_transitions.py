# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Steps of demonstrations and random motion in a domain with contact, to be taken once more.

``python -m support.domain_transitions DOMAIN [--count 600]`` takes them forwards, backwards, in
three shuffles and each in a world of its own, and prints how many differ in any bit.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from slap_ros.core import Domain
from slap_ros.domain_check.experience import Transition, gather
from slap_ros.relational import State
from slap_ros.skills.demonstrator import demonstrate
from slap_ros.skills.domain_choice import DEMONSTRATOR, DomainChoice, open_domain
from slap_ros.worlds.contact.simulation import SIMULATIONS

SHUFFLES = 3


def demonstrator_of(name: str) -> Domain:
    """The domain with scripts for skills."""
    return open_domain(DomainChoice(name, skills=DEMONSTRATOR))


def record(name: str, count: int) -> tuple[Transition, ...]:
    """Steps of one task: half of them of its demonstration, half at random from its states.

    Args:
        name: The domain's.
        count: How many.
    """
    domain = demonstrator_of(name)
    task = domain.task(0)
    episode = demonstrate(domain, task).episode
    rng = np.random.default_rng(1)
    return gather(domain, task.initial_state, [episode], count, rng).transitions


def differing(name: str, steps: Iterable[Transition]) -> int:
    """How many steps come out differently, in any bit, one after the other in a fresh world."""
    steps = list(steps)
    SIMULATIONS.forget()  # a new PyBullet client
    with demonstrator_of(name).make_world(steps[0].state) as world:
        count = 0
        for step in steps:
            world.reset(step.state)
            count += world.step(step.action).key != step.following.key
    return count


def orders(steps: Sequence[Transition]) -> dict[str, list[list[Transition]]]:
    """By name, the steps in an order: in one world, or one list for each world."""
    shuffled = [np.random.default_rng(i).permutation(len(steps)) for i in range(SHUFFLES)]
    return {
        "forwards": [[*steps]],
        "backwards": [[*reversed(steps)]],
        **{f"shuffle {i + 1}": [[steps[k] for k in order]] for i, order in enumerate(shuffled)},
        "in worlds of their own": [[step] for step in steps],
    }


def save(steps: Sequence[Transition], path: Path) -> None:
    """Write steps for another process."""
    rows = [np.stack(part) for part in zip(*map(_arrays, steps), strict=True)]
    np.savez(path, *rows)


def load(name: str, path: Path) -> list[Transition]:
    """Read steps of the same task of a domain."""
    state = partial(State, demonstrator_of(name).task(0).initial_state.layout)
    with np.load(path) as file:
        before, actions, after = (file[f"arr_{i}"] for i in range(3))
    return [
        Transition(state(b.copy()), a, state(c.copy()))
        for b, a, c in zip(before, actions, after, strict=True)
    ]


def _arrays(step: Transition) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return step.state.data, step.action, step.following.data


def main() -> None:
    """Print how many differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("domain")
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--file", type=Path, help="steps that were saved, instead of new ones")
    arguments = parser.parse_args()
    name = arguments.domain
    if arguments.file:
        steps = load(name, arguments.file)
        sys.stdout.write(f"{differing(name, steps)} of {len(steps)} differ\n")
        return
    steps = record(name, arguments.count)
    for order, worlds in orders(steps).items():
        count = sum(differing(name, world) for world in worlds)
        sys.stdout.write(f"{name}, {order}: {count} of {len(steps)} differ\n")


if __name__ == "__main__":
    main()
