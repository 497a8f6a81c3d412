# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the record of a learned shortcut says of what found it and of what showed it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

from slap_ros.shortcuts.candidate_groups import CandidateGroup
from slap_ros.shortcuts.demonstrations import ShortcutDemonstration
from slap_ros.shortcuts.exploration_policies import RANDOM
from slap_ros.shortcuts.shortcut import Shortcut


def with_origin(shortcut: Shortcut, group: CandidateGroup) -> Shortcut:
    """The shortcut, whose record says what found it; random actions do where it says nothing."""
    if group.found_by == (RANDOM,):
        return shortcut
    return replace(shortcut, record={**shortcut.record, "found_by": list(group.found_by)})


def with_demonstrations(shortcut: Shortcut, shown: Sequence[ShortcutDemonstration]) -> Shortcut:
    """The shortcut, whose record counts demonstrations and the environment steps they took."""
    if not shown:
        return shortcut
    steps = sum(one.environment_steps for one in shown)
    counts = {
        "environment_steps": int(shortcut.record["environment_steps"]) + steps,
        "demonstrations": {
            "number": len(shown),
            "environment_steps": steps,
            "skills": fmean(one.replaced for one in shown),
            "straightened": fmean(len(one.actions) for one in shown),
        },
    }
    return replace(shortcut, record={**shortcut.record, **counts})
