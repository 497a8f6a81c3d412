# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal of the skill server: each perceived state is answered with a command until it ends."""

from __future__ import annotations

from dataclasses import dataclass
from time import monotonic

from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from slap_msgs.action import ExecuteSkill
from slap_msgs.msg import SkillEvent

from ensemble import encode
from ensemble.answering import error_to_answer
from ensemble.node_liveness import NodeLiveness
from ensemble.observation import Observation
from ensemble.patience import load_advice
from skill_server.skill_publisher import SkillPublisher
from slap_ros.core import Action
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import Option


@dataclass
class SkillExecution:
    """A skill under way.

    Args:
        node: Node whose log gets the traceback of an error that is not one of slap_ros.
        goal: What was asked for.
        execution: The option on its way to the expected atoms.
        start: Where it starts.
        step_budget: Environment steps that it may take.
        planner: Whether it is there: without it the skill is given up.
        publisher: Publisher of commands and events.
    """

    node: Node
    goal: ServerGoalHandle
    execution: OptionExecution
    start: Observation
    step_budget: int
    planner: NodeLiveness
    publisher: SkillPublisher

    def __post_init__(self) -> None:
        self.latest = self.start
        self._ended = Future()  # of OptionResult
        self._newest_s = monotonic()  # when the latest observation came

    @property
    def option(self) -> Option:
        """What is executed."""
        return self.execution.option

    async def run(self, latest: Observation) -> ExecuteSkill.Result:
        """Execute from the newest observation to the end, and conclude the goal."""
        self._publish_event(SkillEvent.STARTED, OptionResult(ErrorCode.NONE))
        self.advance(latest)
        outcome: OptionResult = await self._ended
        if outcome.reached:
            kind, conclude = SkillEvent.REACHED, self.goal.succeed
        elif outcome.code is ErrorCode.SKILL_CANCELED:
            kind, conclude = SkillEvent.CANCELED, self.goal.canceled
        else:
            kind, conclude = SkillEvent.FAILED, self.goal.abort
        self._publish_event(kind, outcome)
        conclude()
        answer = result(outcome, self._steps)
        answer.atoms = self._atoms()
        return answer

    def advance(self, observation: Observation) -> None:
        """Answer an observation with a command, or end."""
        if self._ended.done():
            return
        self._newest_s = monotonic()
        if observation.episode is not self.start.episode:
            self._stop(ErrorCode.EPISODE_CHANGED, "the simulator was reset")
            return
        self.latest = observation
        if self.goal.is_cancel_requested:
            self._hold()
            return
        self.goal.publish_feedback(ExecuteSkill.Feedback(step=self._steps, atoms=self._atoms()))
        action = self._next(observation)
        if isinstance(action, OptionResult):
            self._ended.set_result(action)
        elif self._steps >= self.step_budget:
            self._stop(ErrorCode.STEP_LIMIT, f"not done within {self.step_budget} steps")
        else:
            self.publisher.command(action, self.latest)

    def _next(self, observation: Observation) -> Action | OptionResult:
        try:
            return self.execution.advance(
                observation.state, observation.abstract, observation.missing
            )
        except Exception as raised:  # of a skill's policy
            error = error_to_answer(self.node, raised)
            return OptionResult(error.code, f"{self.option}: {error}")

    def end_with(self, error: SlapError) -> None:
        """End, as the episode has."""
        if not self._ended.done():
            self._stop(error.code, str(error))

    def check(self, state_timeout_s: float) -> None:
        """End if no state has come for ``state_timeout_s``, or the planner is gone."""
        if self._ended.done():
            return
        silence_s = monotonic() - self._newest_s
        if silence_s > state_timeout_s:
            reason = f"no new state for {silence_s:.1f} s; {load_advice()}"
            self._stop(ErrorCode.NO_STATE, reason)
        elif self.planner.is_lost():
            self._stop(ErrorCode.NODE_DIED, "the planner is gone; the robot holds")

    @property
    def _steps(self) -> int:
        """Environment steps taken so far."""
        return self.latest.step - self.start.step

    def _atoms(self) -> list[object]:
        """The atoms that hold, as messages."""
        return encode.atoms(self.start.episode.space.decode(self.latest.abstract))

    def _hold(self) -> None:
        """Stop the robot where it is, gripper as it is."""
        self.publisher.command(self.start.episode.domain.action_space.hold, self.latest)
        self._stop(ErrorCode.SKILL_CANCELED, "canceled")

    def _stop(self, code: ErrorCode, reason: str) -> None:
        self._ended.set_result(OptionResult(code, f"{self.option}: {reason}"))

    def _publish_event(self, kind: int, outcome: OptionResult) -> None:
        self.publisher.event(kind, self.option, self.latest, outcome)


def result(outcome: OptionResult, steps: int) -> ExecuteSkill.Result:
    """The action's result, without atoms; ``steps`` are environment steps."""
    return ExecuteSkill.Result(steps=steps, error_code=int(outcome.code), error_msg=outcome.reason)
