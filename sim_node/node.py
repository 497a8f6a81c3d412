# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a domain's world in lock-step: one step for one command.

ROS Parameters:
    domain (string, "obstacle2d"): which domain.
    preset (string, "fair"): random tasks (fair) or the paper's start states (paper).
    seed (int, 0): samples the first task.
    index (int, 0): which of the seed's tasks.
    pace (double, 0.0): environment steps a second, for watching; 0: as fast as commands come.
    visualize (bool, true): publish markers, frames and joint states.

Publishers:
    slap/domain (slap_msgs/DomainInfo): what world runs; latched.
    slap/task (slap_msgs/Task): the episode's task; latched.
    slap/state (slap_msgs/ObjectCentricState): the state after each step.
    slap/markers (visualization_msgs/MarkerArray), tf (tf2_msgs/TFMessage), joint_states
        (sensor_msgs/JointState): the same for RViz and Foxglove.
    diagnostics (diagnostic_msgs/DiagnosticArray): steps taken and commands refused; 1 Hz.

Subscribers:
    slap/command (slap_msgs/RobotCommand): refused unless it answers the current state and is in
        the action space.

Services:
    slap/reset_task (slap_msgs/ResetTask): opens a new episode.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.timer import Timer
from slap_msgs.msg import RobotCommand
from slap_msgs.srv import ResetTask

from ensemble import encode
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.entry_point import run_node
from ensemble.interfaces import COMMAND, DOMAIN, RESET_TASK, STATE, TASK, VOLATILE
from ensemble.parameters import parameter, read_parameters
from ensemble.visualization import Visualizer
from slap_ros.core import Domain, Task, World
from slap_ros.domains import get_domain
from slap_ros.errors import (
    ErrorCode,
    InvalidCommandError,
    SlapError,
    StaleCommandError,
)
from slap_ros.messages.decode import decode_command, decode_goal, decode_state
from slap_ros.relational import State

EXPLICIT = -1  # seed of a task that was not sampled


@dataclass(frozen=True)
class SimParameters:
    """See the module's docstring."""

    domain: str = parameter("obstacle2d", "which domain")
    preset: str = parameter("fair", "fair: random tasks; paper: the paper's start states")
    seed: int = parameter(0, "samples the first task")
    index: int = parameter(0, "which of the seed's tasks")
    pace: float = parameter(0.0, "environment steps a second; 0: as fast as commands come")
    visualize: bool = parameter(True, "publish markers, frames and joint states")


class SimNode(Node):
    """The simulator."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("sim_node", **kwargs)
        parameters = read_parameters(self, SimParameters)
        self._domain: Domain = get_domain(parameters.domain, parameters.preset)
        self._pace = parameters.pace
        self._world: World
        self._timer: Timer | None = None  # until the next state is due
        self._episode = 0
        self._step = 0
        self._counts = Counter(steps=0, stale_commands=0, invalid_commands=0)

        self._visualizer = Visualizer(self, self._domain) if parameters.visualize else None
        self._domains = self.create_publisher(DOMAIN.type, DOMAIN.name, DOMAIN.qos)
        self._tasks = self.create_publisher(TASK.type, TASK.name, TASK.qos)
        self._states = self.create_publisher(STATE.type, STATE.name, STATE.qos)
        # Fresh: commands from before this node started belong to another simulator's states.
        self.create_subscription(COMMAND.type, COMMAND.name, self._on_command, VOLATILE)
        self.create_service(RESET_TASK.type, RESET_TASK.name, self._on_reset)
        DiagnosticsPublisher(self, lambda: self._counts | {"episode": self._episode})

        self._domains.publish(encode.domain_info(self._domain, self._now()))
        task = self._domain.task(parameters.seed, parameters.index)
        self._open_episode(task, parameters.seed, parameters.index)

    def _now(self) -> Time:
        return self.get_clock().now().to_msg()

    def _open_episode(self, task: Task, seed: int, index: int) -> None:
        self._world = self._domain.make_world(task.initial_state)
        self._stop_waiting()
        self._episode += 1
        self._step = 0
        now = self._now()
        message = encode.task(task, self._domain, self._episode, seed, index, now)
        self._tasks.publish(message)
        self._states.publish(message.initial_state)
        self._show(task.initial_state, now)
        self.get_logger().info(f"episode {self._episode}: {self._domain.name}, seed {seed}")

    def _on_command(self, message: RobotCommand) -> None:
        try:
            self._check_moment(message)
            state = self._world.step(decode_command(message))
        except StaleCommandError as error:
            self._refuse("stale_commands", error)
        except InvalidCommandError as error:
            self._refuse("invalid_commands", error)
        else:
            self._counts["steps"] += 1
            if self._pace > 0.0:
                self._timer = self.create_timer(1.0 / self._pace, lambda: self._advance(state))
            else:
                self._advance(state)

    def _advance(self, state: State) -> None:
        self._stop_waiting()
        self._step += 1
        now = self._now()
        self._states.publish(encode.state(state, self._episode, self._step, now))
        self._show(state, now)

    def _show(self, state: State, stamp: Time) -> None:
        # After the state: the others are at work meanwhile.
        if self._visualizer is not None:
            self._visualizer.show(state, stamp)

    def _stop_waiting(self) -> None:
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def _check_moment(self, message: RobotCommand) -> None:
        answered = self._timer is not None
        if answered or (message.episode, message.step) != (self._episode, self._step):
            raise StaleCommandError(
                f"command for episode {message.episode}, step {message.step} refused: "
                f"the world is at episode {self._episode}, step {self._step}"
                f"{', which has its command' if answered else ''}"
            )

    def _refuse(self, kind: str, error: SlapError) -> None:
        self._counts[kind] += 1
        self.get_logger().warning(f"{error} ({self._counts[kind]} {kind.replace('_', ' ')})")

    def _on_reset(
        self, request: ResetTask.Request, response: ResetTask.Response
    ) -> ResetTask.Response:
        try:
            if request.initial_state.objects:
                self._open_episode(self._explicit_task(request), EXPLICIT, 0)
            else:
                task = self._domain.task(request.seed, request.index)
                self._open_episode(task, request.seed, request.index)
        except SlapError as error:
            response.error_code, response.error_msg = int(error.code), str(error)
        else:
            response.error_code = int(ErrorCode.NONE)
        response.episode = self._episode
        return response

    def _explicit_task(self, request: ResetTask.Request) -> Task:
        initial = decode_state(request.initial_state, self._domain.types_by_name)
        goal = decode_goal(request.goal, self._domain.atom_space(initial))
        return Task(initial, goal or self._domain.default_goal(initial), self._domain.step_limit)


def main() -> int:
    """Run the node."""
    return run_node("sim_node", SimNode)
