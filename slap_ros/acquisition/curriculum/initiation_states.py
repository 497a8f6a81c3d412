# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Initiation states: where the skills of carried-out plans began (LG-SAIL Alg. 1).

A failed stage leaves the simulator state in which its skill began. The skill is trained from these
states, and from some in which it succeeded, so that it does not forget them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from typing import NamedTuple

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout


class InitiationRecord(NamedTuple):
    """An initiation state of a skill, as data that other processes can be sent."""

    task: int  # index of the task
    objects: tuple[str, ...]  # names of the objects that the skill was applied to
    state: tuple[float, ...]  # features of the state after the approach


@dataclass(frozen=True)
class InitiationStates:
    """The initiation states of the skill of one operator in some rollouts.

    Args:
        failed: Initiation states from which the stage failed.
        succeeded: Initiation states from which the stage was done.
    """

    failed: tuple[InitiationRecord, ...]
    succeeded: tuple[InitiationRecord, ...]

    @classmethod
    def of(cls, operator: str, rollouts: Iterable[PlanRollout]) -> InitiationStates:
        """The initiation states in rollouts, in order; none where the approach did not arrive.

        Args:
            operator: Name of the operator.
            rollouts: Plans that were carried out.
        """
        begun = [
            (stage.done, InitiationRecord(rollout.task, stage.objects, stage.state))
            for rollout in rollouts
            for stage in rollout.stages
            if stage.operator == operator and stage.state
        ]
        return cls(
            tuple(record for done, record in begun if not done),
            tuple(record for done, record in begun if done),
        )

    @property
    def all(self) -> tuple[InitiationRecord, ...]:
        """All initiation states, those from which the skill failed first."""
        return self.failed + self.succeeded

    @property
    def for_another(self) -> InitiationStates:
        """The same states for a skill that is learned from scratch: it has succeeded from none."""
        return InitiationStates(self.all, ())

    @property
    def digest(self) -> str:
        """A hash of the states, the same whatever their order."""
        return sha256(json.dumps(sorted(self.all)).encode()).hexdigest()

    def with_rehearsal(self, share: float) -> tuple[InitiationRecord, ...]:
        """The states of failures, and so many of successes that these are a share of all.

        Args:
            share: Share of the returned states that the skill succeeded from; below 1.
        """
        rehearsed = round(len(self.failed) * share / (1.0 - share))
        return self.failed + self.succeeded[:rehearsed]
