# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Solves tasks: plans over the abstract graph, has the skill server execute, watches, replans.

ROS Parameters:
    planner (string, "anytime"): anytime, lazy, exhaustive, ff or astar; anytime may have settings,
        as in anytime:within=1.25,effort=4; see ``slap_ros.planning.planner_choice``.
    shortcuts (string, ""): folder of a shortcut library; or none; or grown, for what
        slap/grow_skills leaves beside the skills of slap/skills; empty: the shipped one.
    samples (int, 16): attempts of a shortcut in the model; the shortest is used.
    observation_timeout (double, 10.0): seconds to wait for a perceived state.
    server_timeout (double, 5.0): seconds without a skill server after which a run fails.
    domain (string, ""), preset (string, ""): imported before the node has servers; empty: whichever
        the simulator announces, in a thread.
    skills (string, ""): whose skills the domain has: none, demonstrator, or a library's folder;
        empty: whichever the simulator announces. A domain that is announced with others is refused.
    libraries (string, "runs/skills"): folders below which a library that slap/skills names may lie,
        separated by ':'; others are refused.
    patience (double, 1.0): factor of all deadlines, for slow domains and machines.

Publishers:
    slap/plan (slap_msgs/Plan): the plan under execution; latched.
    slap/plan_events (slap_msgs/PlanEvent): what happens to it.
    diagnostics (diagnostic_msgs/DiagnosticArray): tasks tried and solved, messages refused;
        1 Hz.

Subscribers:
    slap/domain, slap/task, slap/skills, slap/state, slap/atoms, slap/fault: see
        ``ensemble.observation``.

Action servers:
    slap/solve_task (slap_msgs/SolveTask): solve an episode's task.

Action clients:
    slap/execute_skill (slap_msgs/ExecuteSkill): one goal per edge of the plan.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import SolveTask

from ensemble.answering import error_to_answer
from ensemble.common_parameters import read_with_common
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import run_in_executor
from ensemble.interfaces import EXECUTE_SKILL, SOLVE_TASK
from ensemble.observation import Episode, Observation
from ensemble.parameters import parameter
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from ensemble.state_synchronizer import StateSynchronizer
from planner_node.plan_publisher import PlanPublisher
from planner_node.skill_server_watch import SkillServerWatch
from planner_node.task_execution import TaskExecution
from slap_ros.errors import (
    BusyError,
    NoTaskError,
    TaskCanceledError,
)
from slap_ros.messages.decode import decode_goal
from slap_ros.planning.partial import PartialPlanner
from slap_ros.planning.planner import PLANNERS, Planner, make_planner, require_planner
from slap_ros.planning.planner_choice import DEFAULT_PLANNER
from slap_ros.relational import State


@dataclass(frozen=True)
class PlannerParameters(ShortcutParameters):
    """See the module's docstring."""

    planner: str = parameter(DEFAULT_PLANNER, f"planner: {', '.join(PLANNERS)}")
    observation_timeout: float = parameter(10.0, "s to wait for a perceived state")
    server_timeout: float = parameter(5.0, "s without a skill server until a run fails")


class PlannerNode(Node):
    """Plans and executes tasks: the server of ``solve_task``."""

    def __init__(self, **kwargs: Any) -> None:
        """Serve the action ``solve_task``.

        Args:
            kwargs: The node's.

        Raises:
            InvalidParameterError: There is no planner of the name that is given.
        """
        super().__init__("planner_node", **kwargs)
        self._settings, common = read_with_common(self, PlannerParameters)
        require_planner(self._settings.planner)
        self._patience = common.patience
        self._shortcuts = ShortcutProvider(self, self._settings, self._settings.planner)
        self._shortcuts.prepare(common.imported())
        self._busy = False
        self._counts = Counter(tried=0, solved=0)
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="planning")
        self._synchronizer = StateSynchronizer(
            self, lambda _: None, self._shortcuts.prepare_episode, common
        )
        self._publisher = PlanPublisher(self)
        self._skills = ActionClient(self, EXECUTE_SKILL.type, EXECUTE_SKILL.name)
        self._actions = ActionServer(
            self,
            SOLVE_TASK.type,
            SOLVE_TASK.name,
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        DiagnosticsPublisher(self, lambda: {**self._counts, **self._synchronizer.counts})

    def destroy_node(self) -> None:
        """Stop the threads as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        self._synchronizer.destroy()
        self._actions.destroy()
        self._skills.destroy()
        super().destroy_node()

    async def _execute(self, goal: ServerGoalHandle) -> SolveTask.Result:
        self._counts["tried"] += 1
        try:
            result = await self._solve(goal)
        except Exception as raised:
            error = error_to_answer(self, raised)
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
            episode = goal.request.episode
            timeout_s = self._settings.observation_timeout * self._patience
            start = await self._synchronizer.observe(episode, timeout_s, NoTaskError)
            if episode:
                start.require_episode(episode)
            execution = await self._prepare(goal, start)
            return await execution.run()
        finally:
            self._busy = False

    async def _prepare(self, goal: ServerGoalHandle, start: Observation) -> TaskExecution:
        episode, name = start.episode, self._settings.planner
        atoms = decode_goal(goal.request.goal, episode.space) or episode.task.goal

        def is_canceled() -> bool:
            latest = self._synchronizer.latest
            return goal.is_cancel_requested or latest is None or latest.episode is not episode

        planner = PartialPlanner(
            episode.space,
            episode.domain.atom_space,
            partial(self._planner_over, episode, is_canceled),
        )
        await run_in_executor(self._workers, partial(planner.prepare, start.state))
        timeout_s = self._settings.server_timeout * self._patience
        return TaskExecution(
            node=self,
            goal=goal,
            synchronizer=self._synchronizer,
            publisher=self._publisher,
            skills=self._skills,
            skill_server=SkillServerWatch(self, self._skills, timeout_s),
            workers=self._workers,
            planner=planner,
            provenance={"planner": name, **self._shortcuts.provenance(episode.domain)},
            goal_mask=episode.space.mask(atoms),
            step_limit=goal.request.step_limit or episode.task.step_limit,
            patience=self._patience,
        )

    def _planner_over(
        self, episode: Episode, is_canceled: Callable[[], bool], known: State
    ) -> Planner:
        """A planner over the objects of a state."""
        shortcuts, name = self._shortcuts.grounded(episode, known), self._settings.planner
        return make_planner(name, episode.domain, known, shortcuts, is_canceled)


def main() -> int:
    """Run the node."""
    return run_node("planner_node", PlannerNode)
