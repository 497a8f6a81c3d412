# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's joints and gripper, or its position, over the steps of a run."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from slap_ros.bags.recording import RecordedEpisode, Recording
from slap_ros.core import Domain
from slap_ros.evaluation.run_trace import RunTrace

USUAL = frozenset({"robot"})  # types of what acts, where a domain names none
HELD = "grasp_"  # how a body lies in the hand: nothing that moves by itself
DIMENSIONS = ("rad", "m")  # units of what moves
FLAT = 1e-9  # rad or m: less than that is rounding


@dataclass(frozen=True)
class Series:
    """One feature over time."""

    name: str
    unit: str
    steps: tuple[int, ...]  # from the run's start
    values: tuple[float, ...]

    @property
    def low(self) -> float:
        """The least value."""
        return min(self.values)

    @property
    def high(self) -> float:
        """The greatest value."""
        return max(self.values)

    @property
    def points(self) -> str:
        """A polyline, x in steps, y from 0 (greatest) to 1 (least)."""
        extent = self.high - self.low
        level = [0.5 if extent < FLAT else (self.high - v) / extent for v in self.values]
        return " ".join(f"{s},{y:.3f}" for s, y in zip(self.steps, level, strict=True))


def robot_types(domain: Domain | None) -> frozenset[str]:
    """Names of the types of what acts; the usual one where the domain names none."""
    named = domain.robot_types if domain is not None else ()
    return frozenset(kind.name for kind in named) or USUAL


def robot_series(
    trace: RunTrace, episode: RecordedEpisode, recording: Recording, domain: Domain | None
) -> tuple[Series, ...]:
    """Every feature of the robot that moves, in the order of its type.

    Args:
        trace: Run to show.
        episode: Recorded episode with the run's states.
        recording: Names and units of the robot's features.
        domain: Domain, which says which types are robots; None where it is not known here.
    """
    info = recording.domain_info
    steps = sorted(s for s in episode.states if trace.first_step <= s <= trace.last_step)
    if info is None or not steps:
        return ()
    found, robots = [], robot_types(domain)
    for message in (t for t in info.types if t.name in robots):
        names, units = list(message.feature_names), list(message.feature_units)
        if len(names) != len(units):
            continue  # nobody knows which unit is missing
        for i, (name, unit) in enumerate(zip(names, units, strict=True)):
            if unit not in DIMENSIONS or name.startswith(HELD):
                continue
            values = {
                step: float(obj.features[i])
                for step in steps
                for obj in episode.states[step].objects
                if obj.type == message.name
                and len(obj.features) == len(names)
                and isfinite(obj.features[i])
            }
            if values:
                relative = tuple(step - trace.first_step for step in values)
                found.append(Series(name, unit, relative, tuple(values.values())))
    return tuple(found)
