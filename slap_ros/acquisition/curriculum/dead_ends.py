# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Dead ends: what a skill leaves may be what no other can continue from.

LG-SAIL's Algorithm 1 trains the skill that fails. But effects do not say everything that the next
skill depends on: a peg that is held beside its middle is held, and cannot be inserted, whatever
Insert learns. So where rounds of training have brought a skill no success from any state, it is
learned from scratch, and so is the skill before it, which may leave other states then.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from slap_ros.acquisition.curriculum.curriculum_state import CurriculumState
from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout

MOST_ATTEMPTS = 3  # attempts at learning a skill from scratch


@dataclass(frozen=True)
class DeadEnd:
    """Two skills in a row at which plans always end.

    Args:
        skill: Name of the skill that never succeeded.
        before: Name of the skill that leaves the states from which the other fails.
    """

    skill: str
    before: str


def find_dead_ends(
    hopeless: Iterable[str], rollouts: Sequence[PlanRollout], state: CurriculumState
) -> list[DeadEnd]:
    """Find skills that never succeeded after others that may be learned from scratch once more.

    Args:
        hopeless: Names of the skills that rounds of training did not improve.
        rollouts: Rollouts of this iteration.
        state: State of the curriculum.

    Returns:
        One dead end for each such skill.
    """
    found = []
    for skill in hopeless:
        before = _before(skill, rollouts)
        if state.skills[skill].success > 0.0 or before is None:
            continue
        if state.skills[before].rounds > 0 and state.skills[before].attempt < MOST_ATTEMPTS - 1:
            found.append(DeadEnd(skill, before))
    return found


def _before(skill: str, rollouts: Sequence[PlanRollout]) -> str | None:
    """The skill that most often ran just before another failed; None where that comes first."""
    stages = [rollout.stages for rollout in rollouts]
    ran = Counter(
        one[-2].operator
        for one in stages
        if len(one) > 1 and one[-1].operator == skill and not one[-1].done
    )
    return ran.most_common(1)[0][0] if ran else None
