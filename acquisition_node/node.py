# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proposes operators and rewards for the task of an episode (LG-SAIL §4).

ROS Parameters:
    language_settings (string, ""): JSON file with model, server and sampling; see
        ``docs/language.md``. The key is the environment's OPENAI_API_KEY, never a parameter.
    model (string, ""), base_url (string, ""): instead of the settings' own, or of
        SLAP_LANGUAGE_MODEL and SLAP_LANGUAGE_BASE_URL.
    cassette (string, "live"): live, record:FILE, replay:FILE, or off.
    demonstrations (string, ""): bags for the proposer ``induced``, separated by blanks.
    attempts (int, 40), tokens (int, 400000), seconds (double, 900.0): the most that one goal may
        spend on a language model.
    task_timeout (double, 10.0): seconds to wait for a task.
    domain (string, ""), preset (string, ""): imported at the start; empty: whichever the simulator
        announces.
    skills (string, ""): as perception_node's.
    patience (double, 1.0): factor of all deadlines, for slow domains and machines.

Publishers:
    slap/acquisition_events (slap_msgs/AcquisitionEvent): questions' answers and what is wrong with
        them.
    diagnostics (diagnostic_msgs/DiagnosticArray): proposals asked for and made; 1 Hz.

Subscribers:
    slap/domain, slap/task: see ``ensemble.observation``.

Action servers:
    slap/propose_operators (slap_msgs/ProposeOperators): one proposal.
"""

from __future__ import annotations

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from time import monotonic
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import ProposeOperators

from acquisition_node.acquisition_publisher import AcquisitionPublisher
from acquisition_node.inquiry_parameters import InquiryParameters
from acquisition_node.proposal_request import ProposalRequest, make_proposal
from ensemble.answering import error_to_answer
from ensemble.common_parameters import CommonParameters
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.episode_tracker import EpisodeTracker
from ensemble.futures import submit, wait_for_first, wait_until
from ensemble.interfaces import PROPOSE_OPERATORS
from ensemble.observation import Episode
from ensemble.parameters import read_parameters
from ensemble.refusals import Refusals
from slap_ros.errors import BusyError, EpisodeChangedError, NoTaskError, TaskCanceledError
from slap_ros.messages.decode import decode_goal

THREADS = 2  # a canceled proposal may still wait for its model while the next one begins


class AcquisitionNode(Node):
    """Makes proposals: the server of ``propose_operators``."""

    def __init__(self, **kwargs: Any) -> None:
        """Serve the action ``propose_operators``; ``kwargs`` are the node's."""
        super().__init__("acquisition_node", **kwargs)
        self._settings = read_parameters(self, InquiryParameters)
        common = read_parameters(self, CommonParameters)
        common.imported()
        self._timeout_s = self._settings.task_timeout * common.patience
        self._busy = False
        self._counts = Counter(asked=0, proposed=0)
        self._workers = ThreadPoolExecutor(THREADS, thread_name_prefix="proposing")
        refusals = Refusals(self)
        self._episodes = EpisodeTracker(
            self, lambda _: None, lambda *_: None, refusals, common.skills
        )
        self._publisher = AcquisitionPublisher(self)
        self._actions = ActionServer(
            self,
            PROPOSE_OPERATORS.type,
            PROPOSE_OPERATORS.name,
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        DiagnosticsPublisher(self, lambda: {**self._counts, **refusals.counts})

    def destroy_node(self) -> None:
        """Stop the threads as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        self._episodes.destroy()
        self._actions.destroy()
        super().destroy_node()

    async def _execute(self, goal: ServerGoalHandle) -> ProposeOperators.Result:
        self._counts["asked"] += 1
        try:
            result = await self._propose(goal)
        except Exception as raised:
            error = error_to_answer(self, raised)
            self._publisher.failed(error)
            result = ProposeOperators.Result(error_code=int(error.code), error_msg=str(error))
        if result.success:
            self._counts["proposed"] += 1
            goal.succeed()
        elif result.error_code == TaskCanceledError.code:
            goal.canceled()
        else:
            goal.abort()
        return result

    async def _propose(self, goal: ServerGoalHandle) -> ProposeOperators.Result:
        if self._busy:
            raise BusyError("another proposal is under way; cancel it first")
        self._busy = True
        try:
            episode = await self._episode(goal.request.episode)
            return await self._answer(goal, episode)
        finally:
            self._busy = False

    async def _episode(self, number: int) -> Episode:
        """The episode that is asked for, once it is known."""
        deadline = monotonic() + self._timeout_s

        def known() -> bool:
            return self._episodes.current is not None and self._episodes.current.number >= number

        await wait_until(self, lambda: known() or monotonic() > deadline)
        episode = self._episodes.current
        if episode is None or not known():
            raise self._episodes.refusal or NoTaskError(
                f"no task within {self._timeout_s} s: is sim_node (or robot_bridge) running?"
            )
        if number and number != episode.number:
            raise EpisodeChangedError(
                f"goal for episode {number}, but episode {episode.number} is under way"
            )
        return episode

    async def _answer(self, goal: ServerGoalHandle, episode: Episode) -> ProposeOperators.Result:
        asked = goal.request
        atoms = decode_goal(asked.goal, episode.space) or episode.task.goal
        request = ProposalRequest(
            domain=episode.domain,
            task=replace(episode.task, goal=atoms),
            proposer=asked.proposer or "manual",
            rewarder=asked.rewarder or "none",
            settings=self._settings.within(asked.attempts, asked.tokens, asked.seconds),
        )
        self._publisher.started(episode.number)
        canceled = partial(getattr, goal, "is_cancel_requested")
        show = partial(self._publisher.entry, goal)
        job = submit(self._workers, partial(make_proposal, request, show, canceled))
        if not await wait_for_first(self, job, canceled):
            raise TaskCanceledError("the proposal was canceled")
        problem, proposal = job.result().result()
        self._publisher.finished(proposal.plan or ())
        return self._publisher.result(proposal, problem)


def main() -> int:
    """Run the node."""
    return run_node("acquisition_node", AcquisitionNode)
