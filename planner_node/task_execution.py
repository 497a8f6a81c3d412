# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the planner: plan, have each edge executed, watch, replan on divergence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from math import inf
from time import monotonic

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from slap_msgs.action import ExecuteSkill, SolveTask
from slap_msgs.msg import PlanEvent

from ensemble import encode
from ensemble.futures import submit, wait_for_first
from ensemble.observation import Observation
from ensemble.patience import load_advice
from ensemble.state_synchronizer import StateSynchronizer
from planner_node.plan_publisher import PlanPublisher
from planner_node.run_statistics import RunStatistics
from planner_node.skill_server_watch import SkillServerWatch
from slap_ros.errors import (
    EpisodeChangedError,
    ErrorCode,
    NodeDiedError,
    NoStateError,
    SkillRejectedError,
    SlapError,
    TaskCanceledError,
)
from slap_ros.planning.execution import DIVERGENCES, FINAL, UNPLANNED
from slap_ros.planning.option_execution import OptionResult
from slap_ros.planning.options import hold_option
from slap_ros.planning.plan import PlanEdge, PlanningResult
from slap_ros.planning.planner import ImprovingPlanner, Planner

ANSWER_TIMEOUT = 5.0  # s, for the skill server to accept a goal, or to end one that is canceled
ASK_AGAIN = 2.0  # s without a result after which it is asked for again
OBSERVE_TIMEOUT = 5.0  # s, for a state that the skill server has seen to be seen here too


@dataclass
class TaskExecution:
    """A SolveTask goal under way.

    Args:
        node: Makes the timers.
        goal: The goal.
        synchronizer: What is known of the world.
        publisher: Publisher of plans and events.
        skills: Client of the skill server.
        skill_server: Tells when the skill server has been away for too long.
        workers: Where planning runs.
        planner: Plans for the episode's objects.
        provenance: What makes the plans, as their messages have it.
        goal_mask: What to reach.
        step_limit: Environment steps.
        patience: Factor of all deadlines.
    """

    node: Node
    goal: ServerGoalHandle
    synchronizer: StateSynchronizer
    publisher: PlanPublisher
    skills: ActionClient
    skill_server: SkillServerWatch
    workers: Executor
    planner: Planner
    provenance: Mapping[str, str | int]
    goal_mask: int
    step_limit: int
    patience: float = 1.0

    def __post_init__(self) -> None:
        self._start = self._latest
        self._statistics = RunStatistics(self._start.step)

    @property
    def _latest(self) -> Observation:
        assert self.synchronizer.latest is not None  # a run begins with an observation
        return self.synchronizer.latest

    @property
    def _last_step(self) -> int:
        """The newest step of the run's own episode; another one counts from 0 again."""
        latest = self._latest
        return latest.step if latest.episode is self._start.episode else self._start.step

    async def run(self) -> SolveTask.Result:
        """Solve the task; every outcome is published as an event, too."""
        while True:
            unplanned = False
            try:
                outcome, unplanned = await self._plan_and_execute()
            except SlapError as error:
                outcome = OptionResult(error.code, str(error))
            misperceived = unplanned and outcome.code not in FINAL and self._may_look_different
            if not misperceived and outcome.code not in DIVERGENCES:
                break
            if self._statistics.replans >= self.goal.request.max_replans:
                limit = f"diverged again after {self.goal.request.max_replans} replans"
                outcome = OptionResult(ErrorCode.REPLANS_EXHAUSTED, f"{limit}: {outcome.reason}")
                break
            if misperceived:
                held = await self._perceive_again()
                if held.code is not ErrorCode.SKILL_STEP_LIMIT:  # with which a hold ends
                    outcome = held
                    break
        if outcome.reached:
            self._event(PlanEvent.SOLVED)
        else:
            self._event(PlanEvent.FAILED, error_code=int(outcome.code), error_msg=outcome.reason)
        return self._statistics.result(self._last_step, outcome)

    async def _plan_and_execute(self) -> tuple[OptionResult, bool]:
        """Make one plan and execute it; second, whether there was no plan."""
        try:
            planned = await self._plan()
        except UNPLANNED as error:
            return OptionResult(error.code, str(error)), True
        return await self._execute_plan(planned), False

    async def _execute_plan(self, planned: PlanningResult) -> OptionResult:
        """Execute a plan, up to its first edge that fails; its rest may get shorter meanwhile."""
        number = 0
        while number < len(planned.plan.edges):
            self._event(PlanEvent.EDGE_STARTED, edge=number)
            improving = self._begin_to_improve(planned, number)
            outcome = await self._execute(planned.plan.edges[number])
            if not outcome.reached:
                if outcome.code in DIVERGENCES:
                    code, reason = int(outcome.code), outcome.reason
                    self._event(PlanEvent.DIVERGED, edge=number, error_code=code, error_msg=reason)
                return outcome
            self._event(PlanEvent.EDGE_REACHED, edge=number)
            number += 1
            if improving is not None and (shorter := await self._improved(improving)) is not None:
                planned, number = shorter, 0
        return OptionResult(ErrorCode.NONE)

    def _begin_to_improve(self, planned: PlanningResult, number: int) -> Future | None:
        """Look for a shorter rest of a plan, in the worker, while one of its edges is executed."""
        planner, start = self.planner, self._latest
        if planned.is_proven or not isinstance(planner, ImprovingPlanner):
            return None

        def improve_rest() -> PlanningResult | None:
            state = start.episode.domain.to_plan_from(start.state)
            return planner.improve_rest(planned, number, state, self.goal_mask)

        return submit(self.workers, improve_rest)

    async def _improved(self, improving: Future) -> PlanningResult | None:
        """Wait for what comes of it, and announce it as the plan; None where nothing does."""
        await self._wait(improving)
        shorter: PlanningResult | None = improving.result().result()
        if shorter is not None:
            self._statistics.improve(shorter)
            self._event(PlanEvent.IMPROVED, edges_rolled_out=shorter.edges_rolled_out)
            self._publish(shorter)
        return shorter

    @property
    def _may_look_different(self) -> bool:
        """Whether another look may show something else, as an episode without nodes has it."""
        latest = self._latest
        return not (latest.exact and latest.episode.domain.is_foreseeable)

    async def _perceive_again(self) -> OptionResult:
        """Hold for a step, to perceive the same again."""
        hold = hold_option(self._latest.episode.domain.action_space)
        try:
            return await self._execute(PlanEdge(hold, hold.target(0), hold.skill.step_limit))
        except SlapError as error:
            return OptionResult(error.code, str(error))

    # -- planning -------------------------------------------------------------------------------

    async def _plan(self) -> PlanningResult:
        state = self._latest.state
        domain = self._latest.episode.domain
        self._statistics.plans += 1
        self._feedback(SolveTask.Feedback.PLANNING)
        started = self._event(PlanEvent.PLANNING_STARTED)
        job = submit(
            self.workers, lambda: self.planner.plan(domain.to_plan_from(state), self.goal_mask)
        )
        await self._wait(job)
        result: PlanningResult = job.result().result()
        if result.fails:
            self.node.get_logger().warning(f"the plan fails in the model: {result.fails}")
        done = self._event(PlanEvent.PLANNED, edges_rolled_out=result.edges_rolled_out)
        self._statistics.add(result, done - started)
        self._publish(result)
        self._feedback(
            SolveTask.Feedback.EXECUTING,
            graph_nodes=result.graph_nodes,
            graph_edges=result.graph_edges,
        )
        return result

    def _publish(self, planned: PlanningResult) -> None:
        """Publish the newest plan."""
        number = self._statistics.plans - 1
        self.publisher.plan(planned, self.goal_mask, number, self._latest, self.provenance)

    # -- execution ------------------------------------------------------------------------------

    async def _execute(self, edge: PlanEdge) -> OptionResult:
        start = self._latest
        budget = self.step_limit - (start.step - self._start.step)
        if budget <= 0:
            return OptionResult(
                ErrorCode.STEP_LIMIT, f"the goal was not reached in {self.step_limit} steps"
            )
        request = ExecuteSkill.Goal(
            episode=start.episode.number,
            edge=encode.plan_edge(edge, start.episode.space),
            step_budget=budget,
        )
        if not self.skills.server_is_ready():  # before it is found, a goal would reach nobody
            await self._wait(Future(), condition=self.skills.server_is_ready)
        sent = self.skills.send_goal_async(request)
        if not await self._wait(sent, ANSWER_TIMEOUT * self.patience):
            raise NodeDiedError(f"skill_server did not accept {edge} in time; {load_advice()}")
        handle = sent.result()
        if not handle.accepted:
            raise SkillRejectedError(
                f"skill_server rejected {edge}: is it another version, or set up otherwise?"
            )
        result = await self._result(handle)
        await self._observe(start.step + result.steps)
        return OptionResult(ErrorCode(result.error_code), result.error_msg)

    async def _result(self, goal: ClientGoalHandle) -> ExecuteSkill.Result:
        """How a skill ended.

        Asked for repeatedly: services are not latched, so that an answer is lost for good when
        the connection between the two nodes is interrupted for a moment.
        """
        ended = goal.get_result_async()
        try:
            while not await self._wait(ended, ASK_AGAIN):
                ended = goal.get_result_async()
        except TaskCanceledError:
            goal.cancel_goal_async()
            await self._wait_for_hold(ended)
            raise
        if ended.result().status == GoalStatus.STATUS_UNKNOWN:
            raise NodeDiedError("skill_server has forgotten the skill: it was started again")
        return ended.result().result

    async def _wait_for_hold(self, ended: Future) -> None:
        """Wait for a canceled skill to end, unless the skill server is gone."""
        deadline = monotonic() + ANSWER_TIMEOUT * self.patience
        await wait_for_first(
            self.node,
            ended,
            lambda: self.skill_server.is_lost() or monotonic() > deadline,
        )

    async def _observe(self, step: int) -> None:
        """Wait until the state of a step is known here too, not only to the skill server.

        Raises:
            NoStateError: It does not arrive in time.
        """
        if self._latest.step >= step:
            return
        timeout_s = OBSERVE_TIMEOUT * self.patience
        if not await self._wait(Future(), timeout_s, lambda: self._latest.step >= step):
            raise NoStateError(
                f"step {step} was not perceived within {timeout_s} s; {load_advice()}"
            )

    async def _wait(
        self,
        future: Future,
        timeout_s: float = inf,
        condition: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Wait for a future or a condition unless the run is over before.

        Args:
            future: What to wait for.
            timeout_s: For how long, s.
            condition: What else to wait for.

        Returns:
            Whether it came before the time was up.

        Raises:
            TaskCanceledError: The goal was canceled.
            NodeDiedError: The skill server is gone.
            EpisodeChangedError: The simulator was reset.
        """
        deadline = monotonic() + timeout_s
        await wait_for_first(
            self.node,
            future,
            lambda: condition() or self._interrupted() or monotonic() > deadline,
        )
        if self.goal.is_cancel_requested:
            raise TaskCanceledError("canceled")
        if self._latest.episode is not self._start.episode:
            raise EpisodeChangedError("the simulator was reset during the run")
        done = future.done() or condition()
        if not done and self.skill_server.is_lost():
            raise NodeDiedError(
                f"skill_server does not answer: it was stopped or died; or {load_advice()}"
            )
        return done

    def _interrupted(self) -> bool:
        return (
            self.goal.is_cancel_requested
            or self._latest.episode is not self._start.episode
            or self.skill_server.is_lost()
        )

    # -- reporting -------------------------------------------------------------------------------

    def _event(self, kind: int, **details: object) -> int:
        number = max(self._statistics.plans - 1, 0)
        return self.publisher.event(kind, self._latest, plan_number=number, **details)

    def _feedback(self, phase: int, **details: int) -> None:
        self.goal.publish_feedback(
            SolveTask.Feedback(phase=phase, step=self._latest.step, **details)
        )
