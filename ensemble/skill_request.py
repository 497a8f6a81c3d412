# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run that lacks skills, or shortcuts: has them learned, and the same task set again."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from time import monotonic
from typing import Any

from rclpy.action import ActionClient
from rclpy.task import Future
from slap_msgs.action import AcquireSkills, GrowSkills
from slap_msgs.msg import DomainInfo, Task

from ensemble import encode
from ensemble.client import RunClient
from ensemble.interfaces import ACQUIRE_SKILLS, GROW_SKILLS, RESET_TASK, Call
from ensemble.patience import load_advice
from ensemble.spinner import Spinner
from slap_ros.errors import ErrorCode, NotReadyError, RunTimeoutError, error_from
from slap_ros.messages.interfaces import DOMAIN_INFO, TASK
from slap_ros.relational import GroundAtom
from slap_ros.skills.domain_choice import DomainChoice

TAKE_ON_S = 5.0  # s, for a reset world to announce itself with its new skills
CANCEL_S = 15.0  # s, for training to end
# Outcomes of a run that better skills, or more of them, may change.
LACKING = frozenset(
    {
        ErrorCode.NO_SKILLS,
        ErrorCode.UNSOLVABLE,
        ErrorCode.REPLANS_EXHAUSTED,
        ErrorCode.STEP_LIMIT,
        ErrorCode.UNKNOWN_SKILL,
    }
)


@dataclass(frozen=True)
class SkillRequest:
    """What is to be learned where a run lacks it.

    Args:
        proposer: Name of the proposer of operators.
        rewarder: Name of the proposer of rewards.
        seed: Seed of all random numbers of the training.
        training: Action that is asked for: skills, or skills and shortcuts over them.
    """

    proposer: str
    rewarder: str
    seed: int = 0
    training: Call = ACQUIRE_SKILLS

    def answers(self, code: ErrorCode) -> bool:
        """Whether what is learned may change how a run ended.

        Args:
            code: Error code of the run. A task that is solved may have a shorter plan.
        """
        return code in LACKING or (self.training is GROW_SKILLS and code == ErrorCode.NONE)


class SkillRequester:
    """Asks the acquisition node for skills, and the world to begin the task again with them."""

    def __init__(self, client: RunClient, spinner: Spinner, patience: float) -> None:
        """Speak as the client of a run.

        Args:
            client: Follows the run.
            spinner: Spins it.
            patience: Factor of all deadlines.
        """
        self._client, self._spinner, self._patience = client, spinner, patience
        self._trainings = {
            call.name: ActionClient(client, call.type, call.name)
            for call in (ACQUIRE_SKILLS, GROW_SKILLS)
        }
        self._reset = client.create_client(RESET_TASK.type, RESET_TASK.name)

    def destroy(self) -> None:
        """Destroy the actions' clients."""
        for client in self._trainings.values():
            client.destroy()

    def ready(self) -> bool:
        """Whether all can be asked."""
        trainings = all(client.server_is_ready() for client in self._trainings.values())
        return trainings and self._reset.service_is_ready()

    def learn(
        self, request: SkillRequest, goal: Collection[GroundAtom], timeout_s: float
    ) -> AcquireSkills.Result | GrowSkills.Result:
        """Have the skills acquired that a goal takes, and shortcuts learned if they are asked for.

        Args:
            request: Action, names of the proposers of operators and rewards, and the seed.
            goal: Atoms to reach; empty for the task's own.
            timeout_s: For how long to wait, s.

        Returns:
            What was learned.

        Raises:
            RunTimeoutError: They are not there in time.
            SlapError: Why there are none.
        """
        end = monotonic() + timeout_s
        training = request.training
        asked = training.type.Goal(
            goal=encode.goal(goal),
            proposer=request.proposer,
            rewarder=request.rewarder,
            seed=request.seed,
        )
        sent = self._trainings[training.name].send_goal_async(asked)
        try:
            self._wait(sent, end, training)
            ended = sent.result().get_result_async()
            self._wait(ended, end, training)
        except (KeyboardInterrupt, RunTimeoutError):
            self._cancel(sent)
            raise
        result = ended.result().result
        if not result.success:
            raise error_from(result.error_code, f"no skills were acquired: {result.error_msg}")
        learned: AcquireSkills.Result | GrowSkills.Result = result
        return learned

    def begin_again(self, digest: str) -> int:
        """Set the newest task again, in a world that has taken the library on.

        Args:
            digest: Digest of the library.

        Returns:
            The new episode's number.

        Raises:
            NotReadyError: The world does not announce the library.
            SlapError: The world refuses the task.
        """
        task: Task = self._client.newest[TASK]
        end = monotonic() + TAKE_ON_S * self._patience
        while True:
            reset = self._reset.call_async(
                RESET_TASK.type.Request(initial_state=task.initial_state, goal=task.goal)
            )
            self._wait(reset, end, RESET_TASK)
            answer = reset.result()
            if answer.error_code:
                raise error_from(answer.error_code, answer.error_msg)
            if self._spinner.spin_until(lambda: self._announces(digest), TAKE_ON_S / 10):
                return int(answer.episode)
            if monotonic() > end:  # else the library was still on its way to the world
                raise NotReadyError(
                    f"the world does not take on the library {digest}; {load_advice()}"
                )

    def _announces(self, digest: str) -> bool:
        info: DomainInfo = self._client.newest[DOMAIN_INFO]
        return DomainChoice.announced(info).digest == digest

    def _wait(self, future: Future, end: float, asked: Call) -> None:
        if not self._spinner.spin_until(future.done, end - monotonic()):
            raise RunTimeoutError(f"{asked.name} did not answer in time; --timeout gives it longer")

    def _cancel(self, sent: Future) -> None:
        """Have training ended: what was learned stays."""
        if sent.done():
            limit_s = CANCEL_S * self._patience
            canceled: Any = sent.result().cancel_goal_async()
            if self._spinner.spin_until(canceled.done, limit_s):
                ended = sent.result().get_result_async()
                self._spinner.spin_until(ended.done, limit_s)
