# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Success over environment steps, from what a training writes while it learns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import ceil
from typing import Any, NamedTuple, Protocol, TypeVar

SUCCESS_CURVE = "success_curve"  # its name in records of trainings
POINTS = 100  # at most, in a record


class SuccessPoint(NamedTuple):
    """Share of recent episodes that succeeded, with noise, after so many environment steps."""

    steps: int
    success: float


class CountsSteps(Protocol):
    """Figures that say after how many environment steps they were measured."""

    @property
    def steps(self) -> int:
        """Environment steps before the measurement."""
        ...


Figures = TypeVar("Figures", bound=CountsSteps)


def by_stage(lines: Iterable[tuple[int, Figures]]) -> dict[int, list[Figures]]:
    """The figures of each stage in the order of their steps.

    A training that was interrupted went on from a checkpoint: what it did twice counts the second
    time.

    Args:
        lines: Number of a stage, and figures with the steps of this stage, in the order in which
            they were written.

    Returns:
        Figures by the number of their stage, in ascending order.
    """
    stages: dict[int, list[Figures]] = {}
    for stage, figures in lines:
        own = stages.setdefault(stage, [])
        while own and own[-1].steps >= figures.steps:
            own.pop()
        own.append(figures)
    return dict(sorted(stages.items()))


def success_curve(lines: Iterable[tuple[int, SuccessPoint]]) -> list[list[float]]:
    """The curve as a record has it: a hundred points at most, the last one among them.

    Args:
        lines: Number of a stage, and a point with the steps of this stage, in the order in which
            they were written.

    Returns:
        Environment steps of all stages so far and success, a pair per point.
    """
    joined: list[SuccessPoint] = []
    for own in by_stage(lines).values():
        before = joined[-1].steps if joined else 0
        joined += [SuccessPoint(before + one.steps, round(one.success, 4)) for one in own]
    every = max(1, ceil(len(joined) / POINTS))
    return [list(point) for point in joined[::-1][::every][::-1]]


def recorded_curve(record: Mapping[str, Any]) -> tuple[SuccessPoint, ...]:
    """The curve in the record of a training; no point where it has none, as of older versions."""
    return tuple(
        SuccessPoint(int(steps), float(success)) for steps, success in record.get(SUCCESS_CURVE, ())
    )
