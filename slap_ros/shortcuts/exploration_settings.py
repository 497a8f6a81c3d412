# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hyper-parameters of exploration (SLAP §4.2, B.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slap_ros.learning.stored_keys import restored, stored

OTHER_WAYS = (
    "also_repeat",
    "pushes",
    "inside",
    "beyond",
    "budget",
    "straightened",
    "regrasps",
    "along_plan",
    "approaches",
)  # settings of exploration that work folders lack where they are off


@dataclass(frozen=True)
class ExplorationSettings:
    """Collecting states and pruning candidates (SLAP §4.2, B.1).

    Args:
        tasks: Number of tasks that are explored.
        rollouts: Number of random rollouts from each recorded state (N_rollout).
        length: Environment steps of each rollout at most (T_rollout).
        hits: Number of rollouts that must reach a pair of abstract states, which else is pruned
            (K_rollout).
        action_repeat: Environment steps for which a random action is repeated: 1 jitters on the
            spot.
        nodes: Number of abstract states explored in a task, the cheapest to reach first.
        also_repeat: Environment steps for which a random action is repeated in as many rollouts
            again; 0 for no such rollouts.
        pushes: Number of batches of straight pushes from each state, at every object.
        inside: Environment steps between the states inside a skill's execution in which rollouts
            begin as well; 0 for none.
        beyond: Whether abstract states count that operators reach in no plan.
        budget: Environment steps of a task; no rollouts are begun that could take more. 0 for no
            such limit.
        straightened: Number of stretches that are tried to make the execution of two skills, one
            after the other, shorter (:mod:`slap_ros.shortcuts.straightening`); 0 for no such
            executions.
        regrasps: Whether two skills also show what leaves the hand as it was, though they take or
            release something on the way. Its policy has the gripper then.
        along_plan: Whether the first of two skills may also begin wherever the plan leads.
        approaches: Number of batches of straight pushes from where each approach of an object ends
            (:mod:`slap_ros.shortcuts.approaches`); 0 for no approaches.
    """

    tasks: int = 4
    rollouts: int = 48
    length: int = 60
    hits: int = 1
    action_repeat: int = 8
    nodes: int = 6
    also_repeat: int = 0
    pushes: int = 0
    inside: int = 0
    beyond: bool = False
    budget: int = 0
    straightened: int = 0
    regrasps: bool = False
    along_plan: bool = False
    approaches: int = 0

    def as_json(self) -> dict[str, Any]:
        """A JSON object, under the keys of :mod:`slap_ros.learning.stored_keys`.

        What else there is than random rollouts from where skills end, and a budget, is left out
        where there is none, as work folders have it from when there was no other way.
        """
        data = stored(self)
        return {name: value for name, value in data.items() if value or name not in OTHER_WAYS}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ExplorationSettings:
        """The settings of :meth:`as_json`.

        Raises:
            TypeError: A key is not a setting.
        """
        return cls(**restored(cls, data))
