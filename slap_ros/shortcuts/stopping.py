# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a shortcut has been learned for long enough: plans get no shorter any more.

The success of a policy says little about that, since a shortcut is tried out several times when
planning, and only the shortest success counts. So plans are made for validation tasks now and then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

from slap_ros.learning.json_lines import append_line, decoded_lines


@dataclass(frozen=True)
class Stopping:
    """A rule by which a stage of learning ends before its environment steps are used up.

    Args:
        every: Environment steps between validations.
        patience: Number of validations in a row, without plans that are shorter, after which the
            stage ends.
        least_saving: Share of the shortest mean plan length so far by which plans must be shorter.
    """

    every: int = 50_000
    patience: int = 2
    least_saving: float = 0.02


@dataclass(frozen=True)
class Validation:
    """Plans that were made with a shortcut while it was learned.

    Args:
        stage: Number of the stage, from 0.
        steps: Environment steps of the stage so far.
        plan_length: Mean plan length on validation tasks, environment steps; infinite where a task
            has no plan.
    """

    stage: int
    steps: int
    plan_length: float


class PlanLengths:
    """The validations of a shortcut, kept in a file, and when they say that a stage is over."""

    def __init__(self, path: Path, rule: Stopping, plan_length: Callable[[], float]) -> None:
        """Go on from what is in a file.

        Args:
            path: Path of the file, which need not exist.
            rule: Rule by which a stage ends.
            plan_length: Function that makes the plans and returns their mean length.

        Raises:
            InvalidParameterError: The file is damaged.
        """
        self._path, self._rule, self._plan_length = path, rule, plan_length
        self.validations = read_validations(path)

    def go_on(self, stage: int, steps: int) -> bool:
        """Validate when it is time; whether the stage goes on.

        Args:
            stage: Number of the stage, from 0.
            steps: Environment steps of the stage so far.
        """
        done = [one for one in self.validations if one.stage == stage]
        last = done[-1].steps if done else 0
        if steps // self._rule.every > last // self._rule.every:
            done.append(Validation(stage, steps, self._plan_length()))
            self._keep(done[-1])
        return not is_flat([one.plan_length for one in done], self._rule)

    def _keep(self, validation: Validation) -> None:
        self.validations.append(validation)
        append_line(self._path, _line(validation))


def is_flat(lengths: Sequence[float], rule: Stopping) -> bool:
    """Whether the last plans are no shorter than the shortest before them.

    As long as no plan was found, nothing is flat.

    Args:
        lengths: Mean plan length of each validation of a stage, in order.
        rule: Rule by which the stage ends.
    """
    before, last = lengths[: -rule.patience], lengths[-rule.patience :]
    best = min(before, default=inf)
    return best < inf and min(last) > best * (1.0 - rule.least_saving)


def read_validations(path: Path) -> list[Validation]:
    """The validations in a file; none where there is no file.

    A line that is not whole, as an interrupted run leaves it, is left out.

    Raises:
        InvalidParameterError: The file is damaged.
    """
    if not path.exists():
        return []
    return decoded_lines(path, _validation, "remove the folder to learn the shortcut again")


def _validation(line: Mapping[str, Any]) -> Validation:
    """The validation in a line; null is no length."""
    length = line["plan_length"]
    return Validation(
        int(line["stage"]), int(line["steps"]), inf if length is None else float(length)
    )


def validation_record(path: Path) -> dict[str, Any]:
    """The validations in a file for a shortcut's record; nothing where there is no file.

    Raises:
        InvalidParameterError: The file is damaged.
    """
    found = read_validations(path)
    return {"plan_lengths": [_line(one) for one in found]} if found else {}


def _line(validation: Validation) -> dict[str, Any]:
    """A validation as JSON; no length is null."""
    length = validation.plan_length
    return {
        "stage": validation.stage,
        "steps": validation.steps,
        "plan_length": None if length == inf else length,
    }
