# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs options and shortcuts: one command for each perceived state.

ROS Parameters:
    shortcuts (string, ""): folder of a shortcut library, or none; empty: the shipped one.
    samples (int, 16): attempts of a shortcut in the model; the shortest is used.
    state_timeout (double, 2.0): seconds without a new state after which a skill is given up.
    patience (int, 0): environment steps for which a skill holds at its end until its target is
        perceived; perception that debounces takes its time.

Publishers:
    slap/command (slap_msgs/RobotCommand): the robot's next step.
    slap/skill_events (slap_msgs/SkillEvent): what happens to each skill.
    diagnostics (diagnostic_msgs/DiagnosticArray): skills run; 1 Hz.

Subscribers:
    slap/domain, slap/task, slap/state, slap/atoms: see ``ensemble.observation``.

Services:
    slap/list_skills (slap_msgs/ListSkills): the current domain's options and learned shortcuts.

Action servers:
    slap/execute_skill (slap_msgs/ExecuteSkill): run a skill. Cancelling makes the robot hold, and
        so does a planner that was there when the skill was asked for and is gone.
"""

from __future__ import annotations

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import ExecuteSkill
from slap_msgs.msg import SkillEvent
from slap_msgs.srv import ListSkills

from ensemble import encode
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import node_time_s, run_in_executor
from ensemble.interfaces import COMMAND, EXECUTE_SKILL, LIST_SKILLS, PLAN_EVENTS, SKILL_EVENTS
from ensemble.node_liveness import NodeLiveness
from ensemble.observation import Observation
from ensemble.parameters import parameter, read_parameters
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from ensemble.state_synchronizer import StateSynchronizer
from skill_server.skill_execution import SkillExecution, requested_option, result
from slap_ros.core import Action
from slap_ros.errors import ErrorCode, NoStateError, SlapError
from slap_ros.planning.options import OptionExecution, Stopped

WATCH_PERIOD = 0.1  # s


@dataclass(frozen=True)
class SkillServerParameters(ShortcutParameters):
    """See the module's docstring."""

    state_timeout: float = parameter(2.0, "s without a new state after which a skill is given up")
    patience: int = parameter(0, "steps to hold at a skill's end until its target is perceived")


class SkillServer(Node):
    """The skill server."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("skill_server", **kwargs)
        self._settings = read_parameters(self, SkillServerParameters)
        self._repertoires = ShortcutProvider(self, self._settings)
        self._run: SkillExecution | None = None
        self._busy = False  # from the acceptance of a goal to its end
        self._counts: Counter[int] = Counter()  # of SkillEvent kinds
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="skill_start")
        self._observer = StateSynchronizer(self, self._on_observation, self._repertoires.open)
        self._commands = self.create_publisher(COMMAND.type, COMMAND.name, COMMAND.qos)
        self._events = self.create_publisher(SKILL_EVENTS.type, SKILL_EVENTS.name, SKILL_EVENTS.qos)
        self.create_service(LIST_SKILLS.type, LIST_SKILLS.name, self._on_list)
        self._actions = ActionServer(
            self,
            EXECUTE_SKILL.type,
            EXECUTE_SKILL.name,
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self.create_timer(WATCH_PERIOD, self._watch)
        DiagnosticsPublisher(self, self._diagnostics)

    def destroy_node(self) -> None:
        """Stop the worker thread as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        self._actions.destroy()
        super().destroy_node()

    def _diagnostics(self) -> dict[str, int]:
        return {
            "started": self._counts[SkillEvent.STARTED],
            "reached": self._counts[SkillEvent.REACHED],
            "failed": self._counts[SkillEvent.FAILED],
            "canceled": self._counts[SkillEvent.CANCELED],
        }

    def _on_list(self, _: ListSkills.Request, response: ListSkills.Response) -> ListSkills.Response:
        episode = self._observer.episode
        if episode is None:
            response.error_code = int(ErrorCode.NO_STATE)
            response.error_msg = "no domain yet: is sim_node running?"
            return response
        domain = episode.domain
        response.skills = [
            *(
                encode.skill_info(operator, domain.skills[operator.name])
                for operator in domain.operators
            ),
            *(
                encode.shortcut_info(shortcut, self._repertoires.sampling)
                for shortcut in self._repertoires.shortcuts(domain)
            ),
        ]
        return response

    # -- the action -----------------------------------------------------------------------------

    async def _execute(self, goal: ServerGoalHandle) -> ExecuteSkill.Result:
        if self._busy:
            goal.abort()
            return result(Stopped(ErrorCode.BUSY, "another skill is under way"), 0)
        self._busy = True
        try:
            self._run = await self._begin(goal)
        except SlapError as error:
            goal.abort()
            return result(Stopped(error.code, str(error)), 0)
        else:
            return await self._finish(self._run)
        finally:
            self._run = None
            self._busy = False

    async def _begin(self, goal: ServerGoalHandle) -> SkillExecution:
        planner = NodeLiveness(self, PLAN_EVENTS)
        start = await self._observe(goal.request.episode)
        # Starting a skill may take a while (motion planning, rehearsal), so not here.
        execution = await run_in_executor(self._workers, lambda: self._start(goal.request, start))
        budget = goal.request.step_budget or execution.option.skill.step_limit
        return SkillExecution(goal, execution, start, budget, planner, heard_s=node_time_s(self))

    def _start(self, request: ExecuteSkill.Goal, start: Observation) -> OptionExecution:
        option, target = requested_option(request, start, self._repertoires)
        actions, patience = start.episode.domain.action_space, self._settings.patience
        return OptionExecution(option, target, actions, start.state, patience)

    async def _observe(self, episode: int) -> Observation:
        """The newest observation; whoever asks for a skill may have seen the episode before us."""
        latest = await self._observer.wait(episode, self._settings.state_timeout)
        if latest is None:
            raise NoStateError(
                f"no perceived state within {self._settings.state_timeout} s: "
                "are sim_node (or robot_bridge) and perception_node running?"
            )
        return latest

    async def _finish(self, run: SkillExecution) -> ExecuteSkill.Result:
        self._publish_event(run, SkillEvent.STARTED, Stopped(ErrorCode.NONE))
        self._advance(run, self._observer.latest)
        stopped = await run.ended
        if stopped.reached:
            kind, conclude = SkillEvent.REACHED, run.goal.succeed
        elif stopped.code is ErrorCode.SKILL_CANCELED:
            kind, conclude = SkillEvent.CANCELED, run.goal.canceled
        else:
            kind, conclude = SkillEvent.FAILED, run.goal.abort
        self._publish_event(run, kind, stopped)
        conclude()
        answer = result(stopped, run.steps)
        space = run.start.episode.space
        answer.atoms = encode.atoms(space.decode(run.latest.abstract))
        return answer

    # -- the control loop -----------------------------------------------------------------------

    def _on_observation(self, observation: Observation) -> None:
        if self._run is not None:
            self._advance(self._run, observation)

    def _advance(self, run: SkillExecution, observation: Observation) -> None:
        """Answer an observation with a command, or end the run."""
        if run.ended.done():
            return
        run.heard_s = node_time_s(self)
        if observation.episode is not run.start.episode:
            run.stop(ErrorCode.EPISODE_CHANGED, "the simulator was reset")
            return
        run.latest = observation
        if run.goal.is_cancel_requested:
            self._hold(run)
            return
        self._publish_feedback(run)
        action = run.execution.advance(observation.state, observation.abstract, observation.missing)
        if isinstance(action, Stopped):
            run.ended.set_result(action)
        elif run.steps >= run.step_budget:
            run.stop(ErrorCode.STEP_LIMIT, f"not done within {run.step_budget} steps")
        else:
            self._command(run, action)

    def _command(self, run: SkillExecution, action: Action) -> None:
        latest, now = run.latest, self.get_clock().now().to_msg()
        self._commands.publish(encode.command(action, latest.episode.number, latest.step, now))

    def _hold(self, run: SkillExecution) -> None:
        """Stop the robot where it is, gripper as it is."""
        self._command(run, np.zeros(len(run.start.episode.domain.action_space.axes)))
        run.stop(ErrorCode.SKILL_CANCELED, "canceled")

    def _watch(self) -> None:
        run = self._run
        if run is None or run.ended.done():
            return
        silence = node_time_s(self) - run.heard_s
        if silence > self._settings.state_timeout:
            run.stop(ErrorCode.NO_STATE, f"no new state for {silence:.1f} s")
        elif run.planner.is_lost():
            run.stop(ErrorCode.NODE_DIED, "the planner is gone; the robot holds")

    # -- telling --------------------------------------------------------------------------------

    def _publish_feedback(self, run: SkillExecution) -> None:
        space = run.start.episode.space
        run.goal.publish_feedback(
            ExecuteSkill.Feedback(
                step=run.steps, atoms=encode.atoms(space.decode(run.latest.abstract))
            )
        )

    def _publish_event(self, run: SkillExecution, kind: int, stopped: Stopped) -> None:
        self._counts[kind] += 1
        self._events.publish(
            SkillEvent(
                header=encode.header(self.get_clock().now().to_msg()),
                episode=run.latest.episode.number,
                step=run.latest.step,
                kind=kind,
                skill=run.execution.option.skill.name,
                objects=[obj.name for obj in run.execution.option.objects],
                error_code=int(stopped.code),
                error_msg=stopped.reason,
            )
        )


def main() -> int:
    """Run the node."""
    return run_node("skill_server", SkillServer)
