# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Solves tasks: plans over the abstract graph, has the skill server execute, watches, replans.

ROS Parameters:
    planner (string, "lazy"): lazy, exhaustive or ff; see ``slap_ros.planning.planner``.
    shortcuts (string, ""): folder of a shortcut library, or none; empty: the shipped one.
    samples (int, 16): attempts of a shortcut in the model; the shortest is used.
    observation_timeout (double, 10.0): seconds to wait for a perceived state.
    server_timeout (double, 5.0): seconds without a skill server after which a run fails.

Publishers:
    slap/plan (slap_msgs/Plan): the plan under execution; latched.
    slap/plan_events (slap_msgs/PlanEvent): what happens to it.
    diagnostics (diagnostic_msgs/DiagnosticArray): tasks tried and solved; 1 Hz.

Subscribers:
    slap/domain, slap/task, slap/state, slap/atoms: see ``ensemble.observation``.

Action servers:
    slap/solve_task (slap_msgs/SolveTask): solve an episode's task.

Action clients:
    slap/execute_skill (slap_msgs/ExecuteSkill): one goal for each edge of the plan.
"""

from __future__ import annotations

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import SolveTask

from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import node_time_s, run_in_executor
from ensemble.interfaces import EXECUTE_SKILL, SKILL_EVENTS, SOLVE_TASK
from ensemble.node_liveness import NodeLiveness
from ensemble.observation import Observation
from ensemble.parameters import parameter, read_parameters
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from ensemble.state_synchronizer import StateSynchronizer
from planner_node.plan_publisher import PlanPublisher
from planner_node.task_execution import TaskExecution
from slap_ros.errors import (
    BusyError,
    EpisodeChangedError,
    InvalidParameterError,
    NoTaskError,
    SlapError,
    TaskCanceledError,
)
from slap_ros.messages.decode import decode_goal
from slap_ros.planning.planner import PLANNERS, make_planner


@dataclass(frozen=True)
class PlannerParameters(ShortcutParameters):
    """See the module's docstring."""

    planner: str = parameter("lazy", "lazy, exhaustive or ff")
    observation_timeout: float = parameter(10.0, "s to wait for a perceived state")
    server_timeout: float = parameter(5.0, "s without a skill server until a run fails")


class PlannerNode(Node):
    """The planner."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("planner_node", **kwargs)
        self._settings = read_parameters(self, PlannerParameters)
        if self._settings.planner not in PLANNERS:
            raise InvalidParameterError(
                f"parameter planner must be one of {', '.join(PLANNERS)}, "
                f"not {self._settings.planner!r}"
            )
        self._repertoires = ShortcutProvider(self, self._settings, self._settings.planner)
        self._busy = False
        self._counts = Counter(tried=0, solved=0)
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="planning")
        self._observer = StateSynchronizer(self, lambda _: None, self._repertoires.open)
        self._reporter = PlanPublisher(self)
        self._skills = ActionClient(self, EXECUTE_SKILL.type, EXECUTE_SKILL.name)
        self._actions = ActionServer(
            self,
            SOLVE_TASK.type,
            SOLVE_TASK.name,
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        DiagnosticsPublisher(self, lambda: self._counts)

    def destroy_node(self) -> None:
        """Stop the planning thread as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        self._actions.destroy()
        self._skills.destroy()
        super().destroy_node()

    async def _execute(self, goal: ServerGoalHandle) -> SolveTask.Result:
        self._counts["tried"] += 1
        try:
            result = await self._solve(goal)
        except SlapError as error:
            result = SolveTask.Result(error_code=int(error.code), error_msg=str(error))
        if result.success:
            self._counts["solved"] += 1
            goal.succeed()
        elif result.error_code == TaskCanceledError.code:
            goal.canceled()
        else:
            goal.abort()
        return result

    async def _solve(self, goal: ServerGoalHandle) -> SolveTask.Result:
        if self._busy:
            raise BusyError("another task is being solved; cancel it first")
        self._busy = True
        try:
            start = await self._observe(goal.request.episode)
            solving = await self._prepare(goal, start)
            return await solving.run()
        finally:
            self._busy = False

    async def _prepare(self, goal: ServerGoalHandle, start: Observation) -> TaskExecution:
        episode = start.episode
        atoms = decode_goal(goal.request.goal, episode.space) or episode.task.goal
        planner = await run_in_executor(
            self._workers,
            lambda: make_planner(
                self._settings.planner,
                episode.domain,
                start.state,
                self._repertoires.of(episode),
            ),
        )
        return TaskExecution(
            self,
            goal,
            self._observer,
            self._reporter,
            self._skills,
            self._skill_server_watch(),
            self._workers,
            planner,
            {"planner": self._settings.planner, **self._repertoires.origin(episode.domain)},
            episode.space.mask(atoms),
            goal.request.step_limit or episode.task.step_limit,
        )

    async def _observe(self, episode: int) -> Observation:
        """The newest observation, waited for until there is one of the episode.

        Who has just reset the simulator may know of the new episode before this node does.
        """
        latest = await self._observer.wait(episode, self._settings.observation_timeout)
        if latest is None or latest.episode.number < episode:
            raise NoTaskError(
                f"no perceived state{f' of episode {episode}' if episode else ''} within "
                f"{self._settings.observation_timeout} s: "
                "are sim_node (or robot_bridge) and perception_node running?"
            )
        if episode and latest.episode.number != episode:
            raise EpisodeChangedError(
                f"goal for episode {episode}, but episode {latest.episode.number} is under way"
            )
        return latest

    def _skill_server_watch(self) -> Any:
        """A function that tells whether this skill server has been away for too long."""
        skill_server = NodeLiveness(self, SKILL_EVENTS)
        last_seen = node_time_s(self)

        def lost() -> bool:
            nonlocal last_seen
            if skill_server.is_alive() and self._skills.server_is_ready():
                last_seen = node_time_s(self)
            return node_time_s(self) - last_seen > self._settings.server_timeout

        return lost


def main() -> int:
    """Run the node."""
    return run_node("planner_node", PlannerNode)
