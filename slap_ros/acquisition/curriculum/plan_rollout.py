# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A plan that was carried out: how far it got, and where it failed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from enum import Enum
from typing import Any


class StageEnd(Enum):
    """How a stage of a plan ended."""

    DONE = "done"
    NOT_LEARNED = "no skill yet"
    NOT_APPROACHED = "the approach did not arrive"
    NO_EFFECT = "effect not reached"
    DISTURBED = "something else disturbed"


@dataclass(frozen=True)
class Stage:
    """One operator of a plan that was carried out.

    Args:
        operator: Name of the operator.
        objects: Names of the objects that the operator was applied to.
        state: Features of the state in which the skill began, after the approach; empty where the
            approach did not arrive.
        end: End of the stage, a value of :class:`StageEnd`.
        steps: Environment steps of the skill, approach not counted.
        atoms: Atoms that are wrong in the end of a failed stage: required ones that do not hold,
            and forbidden ones that do.
        metrics: Normalised metrics of the skill's reward in the end of a failed stage, by their
            text.
    """

    operator: str
    objects: tuple[str, ...]
    state: tuple[float, ...]
    end: str
    steps: int
    atoms: tuple[str, ...] = ()
    metrics: Mapping[str, float] = field(default_factory=dict)

    @property
    def done(self) -> bool:
        """Whether the stage reached its target."""
        return self.end == StageEnd.DONE.value


@dataclass(frozen=True)
class PlanRollout:
    """A task's plan, carried out as far as it went.

    Args:
        task: Index of the task.
        plan: Ground operators of the plan, as text.
        stages: Stages that were begun, in order.
        unplanned: Reason why there is no plan to the goal, in words; empty where there is one.
    """

    task: int
    plan: tuple[str, ...]
    stages: tuple[Stage, ...]
    unplanned: str = ""

    @property
    def progress(self) -> float:
        """Share of the plan's stages that were done in order; 1 where the goal held already."""
        if self.unplanned:
            return 0.0
        return sum(stage.done for stage in self.stages) / len(self.plan) if self.plan else 1.0

    @property
    def failure(self) -> Stage | None:
        """The stage that failed; None where none did."""
        return next((stage for stage in self.stages if not stage.done), None)

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> PlanRollout:
        """The rollout of :meth:`as_json`.

        Raises:
            LookupError, TypeError, ValueError: The data is no rollout.
        """
        stages = tuple(
            Stage(
                str(stage["operator"]),
                tuple(map(str, stage["objects"])),
                tuple(map(float, stage["state"])),
                StageEnd(stage["end"]).value,
                int(stage["steps"]),
                tuple(map(str, stage["atoms"])),
                {str(name): float(value) for name, value in stage.get("metrics", {}).items()},
            )
            for stage in data["stages"]
        )
        plan = tuple(map(str, data["plan"]))
        return cls(int(data["task"]), plan, stages, str(data["unplanned"]))


def failed_stages(rollouts: Iterable[PlanRollout]) -> list[Stage]:
    """The stage that failed of each plan that did not get through, in order."""
    return [stage for rollout in rollouts if (stage := rollout.failure) is not None]
