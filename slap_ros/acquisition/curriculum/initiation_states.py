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

from slap_ros.acquisition.curriculum.rollouts import PlanRollout


class InitiationRecord(NamedTuple):
    """Where a skill began, as data that other processes can be sent."""

    task: int  # its index
    objects: tuple[str, ...]  # names of what the skill was applied to
    state: tuple[float, ...]  # the approach done


@dataclass(frozen=True)
class InitiationStates:
    """Where the skill of one operator began in some rollouts.

    Args:
        failed: Where its stage failed then.
        succeeded: Where its stage was done.
    """

    failed: tuple[InitiationRecord, ...]
    succeeded: tuple[InitiationRecord, ...]

    @classmethod
    def of(cls, operator: str, rollouts: Iterable[PlanRollout]) -> InitiationStates:
        """Those in rollouts, in order; stages whose approach did not arrive have none.

        Args:
            operator: Its name.
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
        """Those where it failed first."""
        return self.failed + self.succeeded

    @property
    def for_another(self) -> InitiationStates:
        """The same for a skill that is learned from scratch: it has succeeded in none."""
        return InitiationStates(self.all, ())

    @property
    def digest(self) -> str:
        """What tells them from others, whatever their order."""
        return sha256(json.dumps(sorted(self.all)).encode()).hexdigest()

    def with_rehearsal(self, share: float) -> tuple[InitiationRecord, ...]:
        """Those where it failed, and so many where it did not that these are a share of all.

        Args:
            share: Of the states in which the skill succeeded; below 1.
        """
        rehearsed = round(len(self.failed) * share / (1.0 - share))
        return self.failed + self.succeeded[:rehearsed]
