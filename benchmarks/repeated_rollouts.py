# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Roll-outs that orders could share: ``python -m benchmarks.repeated_rollouts [--tasks N]``.

What an option does depends on what it touches, so that one may think that picking a third toy up
need not be simulated again where another two were put away first in another order. That is so only
where the robot is in the same state to the bit, and where what it touches is. Counted are all
options that are simulated for a plan and for its execution, in which the rest is improved; those
that begin with the same option and robot as an earlier one; and those of these that also move the
same bodies to the same places in as many steps, a bound of what sharing could save.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import process_time
from typing import NamedTuple
from unittest.mock import patch

from benchmarks.full_tables import plan, warm_up
from benchmarks.printing import show
from slap_ros.domains import get_domain
from slap_ros.planning.model import Model, Rollout
from slap_ros.planning.options import Option
from slap_ros.relational import State, Target
from slap_ros.worlds.joint_space.features import ROBOT

FIRST_SEED = 300
TABLES = (
    ("obstacle_tower", "fair:obstacles=5"),
    ("obstacle_tower", "fair:obstacles=8"),
    ("cleanup_table", "fair:toys=4"),
    ("cleanup_table", "fair:toys=6"),
    ("cleanup_table", "fair:toys=8"),
)


class Simulated(NamedTuple):
    """An option that was simulated.

    Args:
        option: What was executed.
        state: Where it began.
        rollout: What came of it.
        seconds: Processor time that it took, s.
    """

    option: Option
    state: State
    rollout: Rollout
    seconds: float

    @property
    def beginning(self) -> tuple[Option, bytes]:
        """The option, and the robot where it began."""
        (robot,) = self.state.layout.of_type(ROBOT)
        return self.option, self.state[robot].tobytes()

    @property
    def course(self) -> tuple[Option, bytes, int, bytes, bytes]:
        """The same, with the steps that it took and all that was different in the end."""
        final = self.rollout.final.data
        changed = self.state.data != final
        outcome = changed.tobytes(), final[changed].tobytes()
        return (*self.beginning, self.rollout.steps, *outcome)


@contextmanager
def recorded() -> Iterator[list[Simulated]]:
    """What models simulate meanwhile."""
    found: list[Simulated] = []
    simulate = Model._simulate

    def timed(model: Model, option: Option, state: State, target: Target) -> Rollout:
        start = process_time()
        rollout = simulate(model, option, state, target)
        found.append(Simulated(option, state, rollout, process_time() - start))
        return rollout

    with patch.object(Model, "_simulate", timed):
        yield found


def repeated(simulated: Sequence[Simulated]) -> dict[str, float]:
    """How many options began as an earlier one did, and what they took."""
    again, as_before, seconds = 0, 0, 0.0
    beginnings, courses = set(), set()
    for one in simulated:
        if one.beginning in beginnings:
            again += 1
            as_before += one.course in courses
            seconds += one.seconds
        beginnings.add(one.beginning)
        courses.add(one.course)
    return {
        "rollouts": len(simulated),
        "same_robot": again,
        "same_course": as_before,
        "same_robot_seconds": seconds,
        "rollout_seconds": sum(one.seconds for one in simulated),
    }


def measure(name: str, preset: str, library: str, tasks: int) -> dict[str, float]:
    """The figures of one table, summed over tasks.

    Args:
        name: Name of the domain.
        preset: Preset of the domain.
        library: Choice of the shortcut library.
        tasks: Number of tasks.
    """
    domain, total = get_domain(name, preset), dict[str, float]()
    for seed in range(FIRST_SEED, FIRST_SEED + tasks):
        with recorded() as simulated:  # objects of two tasks are never the same
            plan(domain, domain.task(seed), library)
        for key, value in repeated(simulated).items():
            total[key] = total.get(key, 0.0) + value
    return total


def main() -> None:
    """Print the figures of each table, without shortcuts and with those that ship."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    warm_up()
    figures = {
        f"{name} {preset} {library or 'shipped'}": measure(name, preset, library, arguments.tasks)
        for name, preset in TABLES
        for library in ("none", "")
    }
    show(figures, arguments.json)


if __name__ == "__main__":
    main()
