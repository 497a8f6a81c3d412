# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Executes options and shortcuts: one command per perceived state.

ROS Parameters:
    shortcuts (string, ""): folder of a shortcut library; or none; or grown, for what
        slap/grow_skills leaves beside the skills of slap/skills; empty: the shipped one.
    samples (int, 16): attempts of a shortcut in the model; the shortest is used.
    state_timeout (double, 2.0): seconds without a new state after which a skill is given up.
    hold_steps (int, 0): environment steps for which a skill holds at its end until its target is
        perceived; perception that debounces takes its time.
    domain (string, ""), preset (string, ""): imported before the node has servers; empty: whichever
        the simulator announces, in a thread.
    skills (string, ""): whose skills the domain has: none, demonstrator, or a library's folder;
        empty: whichever the simulator announces. A domain that is announced with others is refused.
    libraries (string, "runs/skills"): folders below which a library that slap/skills names may lie,
        separated by ':'; others are refused.
    patience (double, 1.0): factor of all deadlines, for slow domains and machines.

Publishers:
    slap/command (slap_msgs/RobotCommand): the robot's next step.
    slap/skill_events (slap_msgs/SkillEvent): what happens to each skill.
    diagnostics (diagnostic_msgs/DiagnosticArray): skills run, messages refused; 1 Hz.

Subscribers:
    slap/domain, slap/task, slap/skills, slap/state, slap/atoms, slap/fault: see
        ``ensemble.observation``. A fault ends the skill under way, or the next, with its code.

Services:
    slap/list_skills (slap_msgs/ListSkills): the current domain's options and learned shortcuts.

Action servers:
    slap/execute_skill (slap_msgs/ExecuteSkill): run a skill. Cancelling makes the robot hold, and
        so does a planner that was there when the skill was asked for and is gone.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from slap_msgs.action import ExecuteSkill
from slap_msgs.srv import ListSkills

from ensemble import encode
from ensemble.answering import error_to_answer
from ensemble.common_parameters import read_with_common
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.futures import run_in_executor
from ensemble.interfaces import EXECUTE_SKILL, LIST_SKILLS, PLAN_EVENTS
from ensemble.node_liveness import NodeLiveness
from ensemble.observation import Observation
from ensemble.parameters import parameter
from ensemble.shortcuts import ShortcutParameters, ShortcutProvider
from ensemble.state_synchronizer import StateSynchronizer
from ensemble.steady_time import create_timer
from skill_server.requested_option import requested_option
from skill_server.skill_execution import SkillExecution, result
from skill_server.skill_publisher import SkillPublisher
from slap_ros.errors import ErrorCode, NoStateError
from slap_ros.planning.option_execution import OptionExecution, OptionResult

CHECK_PERIOD = 0.1  # s, between two looks at whether a skill is to be given up


@dataclass(frozen=True)
class SkillServerParameters(ShortcutParameters):
    """See the module's docstring."""

    state_timeout: float = parameter(2.0, "s without a new state after which a skill is given up")
    hold_steps: int = parameter(0, "steps to hold at a skill's end until its target is perceived")


class SkillServer(Node):
    """The skill server."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("skill_server", **kwargs)
        self._settings, common = read_with_common(self, SkillServerParameters)
        self._state_timeout_s = self._settings.state_timeout * common.patience
        self._shortcuts = ShortcutProvider(self, self._settings)
        self._shortcuts.prepare(common.imported())
        self._execution: SkillExecution | None = None
        self._busy = False  # from the acceptance of a goal to its end
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="skill_start")
        self._synchronizer = StateSynchronizer(
            self, self._on_observation, self._shortcuts.prepare_episode, common
        )
        self._publisher = SkillPublisher(self)
        self.create_service(LIST_SKILLS.type, LIST_SKILLS.name, self._on_list)
        self._actions = ActionServer(
            self,
            EXECUTE_SKILL.type,
            EXECUTE_SKILL.name,
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        create_timer(self, CHECK_PERIOD, self._check)
        DiagnosticsPublisher(self, lambda: {**self._publisher.counts, **self._synchronizer.counts})

    def destroy_node(self) -> None:
        """Stop the threads as well."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        self._synchronizer.destroy()
        self._actions.destroy()
        super().destroy_node()

    def _on_list(self, _: ListSkills.Request, response: ListSkills.Response) -> ListSkills.Response:
        episode = self._synchronizer.episode
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
                encode.shortcut_info(shortcut, self._shortcuts.sampling)
                for shortcut in self._shortcuts.shortcuts(domain)
            ),
        ]
        return response

    async def _execute(self, goal: ServerGoalHandle) -> ExecuteSkill.Result:
        if self._busy:
            goal.abort()
            return result(OptionResult(ErrorCode.BUSY, "another skill is under way"), 0)
        self._busy = True
        try:
            self._execution = await self._begin(goal)
        except Exception as raised:  # of a policy, or of a skill given objects it never thought of
            error = error_to_answer(self, raised)
            goal.abort()
            return result(OptionResult(error.code, str(error)), 0)
        else:
            self._end_if_failed()  # meanwhile, or before
            return await self._execution.run(self._synchronizer.latest)
        finally:
            self._execution = None
            self._busy = False

    async def _begin(self, goal: ServerGoalHandle) -> SkillExecution:
        planner = NodeLiveness(self, PLAN_EVENTS)
        episode = goal.request.episode
        start = await self._synchronizer.observe(episode, self._state_timeout_s, NoStateError)
        # Starting a skill may take a while (motion planning, sampling), so not here.
        execution = await run_in_executor(self._workers, lambda: self._start(goal.request, start))
        budget = goal.request.step_budget or execution.option.skill.step_limit
        return SkillExecution(self, goal, execution, start, budget, planner, self._publisher)

    def _start(self, request: ExecuteSkill.Goal, start: Observation) -> OptionExecution:
        option, target = requested_option(request, start, self._shortcuts)
        episode, hold_steps = start.episode, self._settings.hold_steps
        return OptionExecution(
            option,
            target,
            episode.space,
            episode.domain.action_space,
            start.state,
            hold_steps,
            expected_steps=request.edge.predicted_steps,
        )

    def _on_observation(self, observation: Observation) -> None:
        if self._execution is not None:
            self._execution.advance(observation)

    def _end_if_failed(self) -> None:
        """End the skill under way if its episode cannot go on."""
        failure = self._synchronizer.failure
        if self._execution is not None and failure is not None:
            self._execution.end_with(failure)

    def _check(self) -> None:
        self._end_if_failed()
        if self._execution is not None:
            self._execution.check(self._state_timeout_s)


def main() -> int:
    """Run the node."""
    return run_node("skill_server", SkillServer)
