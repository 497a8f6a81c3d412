# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the record of a learned shortcut says of what found it and of what showed it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.demonstrations import DemonstrationAttempt
from slap_ros.shortcuts.exploration_policies import RANDOM
from slap_ros.shortcuts.shortcut import Shortcut


def with_origin(shortcut: Shortcut, group: CandidateGroup) -> Shortcut:
    """The shortcut, whose record says what found it; random actions do where it says nothing."""
    if group.found_by == (RANDOM,):
        return shortcut
    return replace(shortcut, record={**shortcut.record, "found_by": list(group.found_by)})


def with_demonstrations(
    shortcut: Shortcut, attempts: Sequence[DemonstrationAttempt], repetitions: int
) -> Shortcut:
    """The shortcut, whose record counts demonstrations and the environment steps they took.

    With the steps of starts from which nothing shows it, and how many demonstrations begin with
    each approach, if any do.

    Args:
        shortcut: Shortcut that was learned.
        attempts: What came of demonstrating it from each start; nothing if it was not cloned.
        repetitions: Number of times that each demonstration was made again to learn from it.
    """
    shown = [one.shown for one in attempts if one.shown is not None]
    if not shown:
        return shortcut
    steps = sum(one.total_steps(repetitions) for one in attempts)
    begun = Counter(one.approach for one in shown if one.approach)
    counts = {
        "environment_steps": int(shortcut.record["environment_steps"]) + steps,
        "demonstrations": {
            "number": len(shown),
            "environment_steps": steps,
            "skills": fmean(one.replaced for one in shown),
            "straightened": fmean(len(one.actions) for one in shown),
            **({"approaches": dict(begun.most_common())} if begun else {}),
        },
    }
    return replace(shortcut, record={**shortcut.record, **counts})
