# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortcuts tried out bit by bit: ``python -m benchmarks.shortcut_trials [--tasks N] [--json]``.

Obstacle 2D with the shipped shortcuts, in one process, in turns: trials to their ends, as soon as
search comes to an edge, beside trials of only so many steps as search asks for. Both make the same
plans, or the command ends with an error. Steps are those of all worlds of the trials together.
Seconds are of one core. And the activation of a policy's layer, rounded: by our own tanh alone,
and with the library's where rounding hides the difference.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from statistics import fmean
from time import process_time
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from benchmarks.full_tables import FIRST_SEED, plan
from benchmarks.printing import show
from slap_ros.domains import get_domain
from slap_ros.portable_math import on_grid, tanh, tanh_on_grid
from slap_ros.shortcuts.shortcut_trial import RolloutBatch, ShortcutTrial

REPEATS = 200  # of an activation


@contextmanager
def trials_to_their_ends() -> Iterator[None]:
    """Trials whose first part is all of them."""

    def lasts(trial: ShortcutTrial, steps: int) -> bool:
        del trial, steps
        return False

    with patch.object(ShortcutTrial, "lasts", lasts):
        yield


@contextmanager
def counted_steps() -> Iterator[list[int]]:
    """The steps that worlds of trials take meanwhile, an entry for each batch."""
    counts: list[int] = []
    step = RolloutBatch.step

    def counted(batch: RolloutBatch) -> None:
        counts.append(len(batch.states.data))
        step(batch)

    with patch.object(RolloutBatch, "step", counted):
        yield counts


class _Planned(NamedTuple):
    """A plan as text, the seconds that it took, and the steps of trials."""

    plan: str
    seconds: float
    steps: int


def plan_once(seed: int) -> _Planned:
    """Plan for the first task of a seed from scratch."""
    domain = get_domain("obstacle2d")
    with counted_steps() as counts:
        start = process_time()
        planned = plan(domain, domain.task(seed), "")
        seconds = process_time() - start
    assert planned is not None
    return _Planned(str(planned.last), seconds, sum(counts))


def measure_planning(tasks: int) -> dict[str, dict[str, float]]:
    """Both ways to try shortcuts out, in turns.

    Raises:
        RuntimeError: They lead to different plans.
    """
    rows: dict[str, list[_Planned]] = {"to their ends": [], "bit by bit": []}
    for seed in range(FIRST_SEED, FIRST_SEED + tasks):
        with trials_to_their_ends():
            whole = plan_once(seed)
        part = plan_once(seed)
        if part.plan != whole.plan:
            raise RuntimeError(f"seed {seed}: another plan\n{whole.plan}\n{part.plan}")
        rows["to their ends"].append(whole)
        rows["bit by bit"].append(part)
    return {
        name: {
            "seconds_mean": fmean(one.seconds for one in planned),
            "steps_mean": fmean(one.steps for one in planned),
        }
        for name, planned in rows.items()
    }


def microseconds(activate: Callable[[], object]) -> float:
    """Of one call, the mean of many."""
    start = process_time()
    for _ in range(REPEATS):
        activate()
    return 1e6 * (process_time() - start) / REPEATS


def measure_activation() -> dict[str, float]:
    """Of a layer of 64 values for 64 observations."""
    values = np.random.default_rng(0).standard_normal((64, 64))
    return {
        "own_tanh_us": microseconds(lambda: on_grid(tanh(values))),
        "either_us": microseconds(lambda: tanh_on_grid(values)),
    }


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    for seed in range(4):
        plan_once(seed)  # what is loaded once; compiled code comes after some plans
    figures = {**measure_planning(arguments.tasks), "activation": measure_activation()}
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
