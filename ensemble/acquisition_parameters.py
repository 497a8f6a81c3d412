# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS parameters of acquisition_node, which the command line sets as well."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ensemble.parameters import parameter
from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.language.budget import BudgetLimits
from slap_ros.language.settings import read_settings
from slap_ros.shortcuts.named_settings import NEAR


@dataclass(frozen=True)
class AcquisitionParameters:
    """Whom to ask, what it may cost, how skills are learned: see ``acquisition_node.node``."""

    language_settings: str = parameter("", "JSON file with model, server and sampling")
    model: str = parameter("", "instead of the settings' own")
    base_url: str = parameter("", "instead of the settings' own")
    cassette: str = parameter("live", "live, record:FILE, replay:FILE, or off")
    demonstrations: str = parameter("", "bags for the proposer induced, separated by blanks")
    attempts: int = parameter(BudgetLimits.attempts, "answers of a model at most", 1)
    tokens: int = parameter(BudgetLimits.tokens, "of questions and answers at most", 1)
    seconds: float = parameter(BudgetLimits.seconds, "s to wait for a model at most")
    output: str = parameter("runs/skills", "folder for libraries and what is learned for them")
    settings: str = parameter("small", "networks and SAC, as slap acquire --settings has it")
    changes: str = parameter("", "NAME=VALUE of these settings, separated by blanks")
    steps: int = parameter(150_000, "environment steps that all skills together learn for", 1)
    shortcut_settings: str = parameter(NEAR, "of shortcuts, as slap grow --settings has it")
    shortcut_changes: str = parameter("", "NAME=VALUE of these settings, separated by blanks")
    growth_steps: int = parameter(
        1_000_000, "environment steps that skills and shortcuts together are learned for", 1
    )
    jobs: int = parameter(1, "processes that learn", 1, 1000)
    begin_with: str = parameter("", "libraries that skills may begin with, separated by blanks")
    task_timeout: float = parameter(10.0, "s to wait for a task")

    def within(self, attempts: int, tokens: int, seconds: float) -> AcquisitionParameters:
        """The same with what a goal may spend, which is never more than the node allows.

        Args:
            attempts: Answers at most; 0: as the node has it.
            tokens: At most; 0: as the node has it.
            seconds: To wait at most; 0: as the node has it.
        """
        return replace(
            self,
            attempts=min(attempts or self.attempts, self.attempts),
            tokens=min(tokens or self.tokens, self.tokens),
            seconds=min(seconds or self.seconds, self.seconds),
        )

    def inquiry(self, log: AttemptLog) -> Inquiry:
        """A conversation with the model.

        Raises:
            InvalidParameterError: No model is named, or settings cannot be read.
            InvalidCassetteError: The cassette cannot be used.
        """
        path = Path(self.language_settings) if self.language_settings else None
        settings = read_settings(path, self.model or None, self.base_url or None)
        limits = BudgetLimits(self.attempts, self.tokens, self.seconds)
        return Inquiry.opened(settings, self.cassette, limits, log)
