# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All methods that learn whole tasks, by name. Their modules need torch, this one does not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module

from slap_ros.baselines.method import Method


@dataclass(frozen=True)
class MethodEntry:
    """A method before it is imported.

    Args:
        module: Name of its module, which has a :class:`Method` named ``METHOD``.
        help: Sentence that says what it is.
    """

    module: str
    help: str

    def load(self) -> Method:
        """Import the method."""
        method = import_module(f"slap_ros.baselines.{self.module}").METHOD
        assert isinstance(method, Method)
        return method


METHODS: Mapping[str, MethodEntry] = {
    "ppo": MethodEntry("ppo", "PPO of the whole task, by joint displacements alone."),
    "sac": MethodEntry("sac", "SAC of the whole task, rewarded for the stages of its plan."),
    "curriculum": MethodEntry(
        "curriculum", "The same SAC from near the end of demonstrations, moved back with success."
    ),
    "maple": MethodEntry(
        "maple", "SAC that chooses movements of the hand and where they act, as MAPLE does."
    ),
    "sac-her": MethodEntry("sac_her", "SAC with hindsight experience replay of the whole task."),
    "hierarchical": MethodEntry(
        "hierarchical", "PPO over joint displacements and an activation for each ground skill."
    ),
    "sol": MethodEntry("sol", "A controller over skills and learned options, in one network."),
}
