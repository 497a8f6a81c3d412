# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A proposal, made in a thread: whoever is asked may take minutes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ensemble.acquisition_parameters import AcquisitionParameters
from slap_ros.acquisition.proposals.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposal_request import Demonstrations, ProposalRequest
from slap_ros.acquisition.proposals.proposer_names import INDUCED
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.bags.reader import read_bag
from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidParameterError, TaskCanceledError


@dataclass(frozen=True)
class ProposalJob:
    """A proposal that the node is asked for.

    Args:
        domain: Domain of the task.
        task: With the goal that is to be reached.
        proposer: Name of the proposer of operators.
        rewarder: Name of the proposer of rewards.
        settings: Whom to ask, and what it may cost.
    """

    domain: Domain
    task: Task
    proposer: str
    rewarder: str
    settings: AcquisitionParameters

    def run(
        self, show: Callable[[Entry], None], canceled: Callable[[], bool]
    ) -> tuple[AcquisitionProblem, Proposal]:
        """Make the proposal.

        Args:
            show: Called with each answer and each verdict.
            canceled: Asked between answers: whether to stop.

        Returns:
            The problem that was posed, and the proposal.

        Raises:
            InvalidParameterError: There is no such proposer or rewarder, or it lacks what it works
                from.
            ProposalRejectedError: None passed the checks within the budget.
            TaskCanceledError: It was canceled meanwhile.
            SlapError: Why no model could be asked, or no demonstration be read.
        """

        def entry(line: Entry) -> None:
            if canceled():
                raise TaskCanceledError("the proposal was canceled")
            show(line)

        request = ProposalRequest.of_task(
            self.domain, self.task, self.proposer, self.rewarder, self._shown()
        )
        inquiry = self.settings.inquiry(AttemptLog(show=entry)) if request.asks_model else None
        return request.problem, request.propose(inquiry)

    def _shown(self) -> Demonstrations:
        if self.proposer != INDUCED:
            return Demonstrations()
        bags = [Path(text) for text in self.settings.demonstrations.split()]
        if not bags:
            raise InvalidParameterError(
                "the proposer induced needs the parameter demonstrations of acquisition_node"
            )
        shown = (read_demonstrations(read_bag(path), self.domain) for path in bags)
        traces = tuple(trace for part in shown for trace in part)
        return Demonstrations(traces, ", ".join(path.name for path in bags))
