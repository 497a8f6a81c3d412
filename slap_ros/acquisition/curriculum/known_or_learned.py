# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The known skill that another one began with, beside what was learned from it: which one stays.

The checkpoint that stays of a training is the best of many judgements. One of them is soon lucky: a
known skill of .83 was replaced by a checkpoint of .85, and this one solved .55 of other tasks. So
both are tried in the end, from the same states of tasks that decided nothing before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from slap_ros.acquisition.curriculum import jobs
from slap_ros.acquisition.curriculum.initiation_states import InitiationRecord
from slap_ros.acquisition.curriculum.task_source import TaskSource
from slap_ros.acquisition.training.warm_start import WarmStart
from slap_ros.skills.skill_library import load_skill


@dataclass(frozen=True)
class KnownOrLearned:
    """A known skill and what was learned from it, tried from the same states.

    Args:
        states: Number of states.
        known: Success rate of the known skill.
        learned: Success rate of the learned skill.
    """

    states: int
    known: float
    learned: float

    @property
    def known_stays(self) -> bool:
        """Whether the known skill stays: the learned one does no better."""
        return self.states > 0 and self.known >= self.learned

    def as_json(self) -> dict[str, Any]:
        """A JSON object."""
        return asdict(self)


def compare(
    source: TaskSource, start: WarmStart, folder: Path, states: Sequence[InitiationRecord]
) -> dict[str, Any]:
    """Try a known skill and what was learned from it.

    Args:
        source: Source of the tasks.
        start: Known skill that the learning began with.
        folder: Folder of the skill that was learned.
        states: Initiation states of the skill on tasks that decided nothing before.

    Returns:
        The :class:`KnownOrLearned` as JSON.
    """
    learned = load_skill(folder, source.make_domain())
    both = [start, WarmStart.of(learned, 1.0)]
    known, own = jobs.try_known(source, learned.operator.name, both, states)
    return KnownOrLearned(len(states), known, own).as_json()
