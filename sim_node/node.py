# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a domain's world in lock-step: one step per command.

ROS Parameters:
    domain (string, "obstacle2d"): which domain.
    preset (string, ""): the domain's, as fair (random tasks) or paper (the paper's start states);
        empty: its first, which of our domains is fair.
    skills (string, ""): none, demonstrator, or the folder of a library of acquired skills; empty:
        what ships, else those that the domain itself has. Announced to the other nodes.
    libraries (string, "runs/skills"): folders below which a library that slap/skills names may lie,
        separated by ':'; others are refused.
    seed (int, 0): samples the first task.
    index (int, 0): which of the seed's tasks.
    goal (string, ""): of the first task, by name or as atoms; empty: its own. Where the goal has a
        name, the first task of that stream that has the goal's objects.
    pace (double, 0.0): environment steps per second, for watching; 0: as fast as commands come.
    visualize (bool, true): publish markers, frames and joint states.

Publishers:
    slap/domain (slap_msgs/DomainInfo): what world runs; latched.
    slap/task (slap_msgs/Task): the episode's task; latched.
    slap/state (slap_msgs/ObjectCentricState): the state after each step.
    slap/fault (slap_msgs/EpisodeFault): why no state comes any more: the domain raised.
    slap/markers (visualization_msgs/MarkerArray), tf (tf2_msgs/TFMessage), joint_states
        (sensor_msgs/JointState): the same for RViz and Foxglove.
    diagnostics (diagnostic_msgs/DiagnosticArray): steps taken and commands refused; 1 Hz.

Subscribers:
    slap/command (slap_msgs/RobotCommand): refused unless it answers the current state and is in
        the action space.
    slap/skills (slap_msgs/SkillLibrary): acquired skills, taken on with the next episode.

Services:
    slap/reset_task (slap_msgs/ResetTask): opens a new episode.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.timer import Timer
from slap_msgs.srv import ResetTask

from ensemble.entry_point import run_node
from ensemble.lockstep_world import LockstepWorld
from ensemble.parameters import parameter
from ensemble.steady_time import create_timer
from ensemble.visualization import Visualizer
from ensemble.world_parameters import WorldParameters
from slap_ros.core import Action, Task, World
from slap_ros.errors import ErrorCode, InvalidParameterError, InvalidStateError
from slap_ros.messages.decode import decode_goal, decode_state
from slap_ros.relational import State

SLOWEST_PACE = 0.001  # steps per second


@dataclass(frozen=True)
class SimParameters(WorldParameters):
    """See the module's docstring."""

    pace: float = parameter(0.0, "environment steps per second; 0: as fast as commands come")
    visualize: bool = parameter(True, "publish markers, frames and joint states")

    def __post_init__(self) -> None:
        """Refuse steps that take hours.

        Raises:
            InvalidParameterError: ``pace`` is between 0 and ``SLOWEST_PACE``.
        """
        if 0.0 < self.pace < SLOWEST_PACE:
            raise InvalidParameterError(
                f"parameter pace is 0 or at least {SLOWEST_PACE}, not {self.pace}"
            )


class SimNode(LockstepWorld[SimParameters]):
    """Simulates a task in lock-step: one step per command, one state after it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("sim_node", SimParameters, (), **kwargs)
        self._world: World
        self._timer: Timer | None = None  # until the next state is due
        visualize = self._settings.visualize
        self._visualizer = Visualizer(self, self._domain) if visualize else None
        self._begin(self._settings.first_task(self._domain))

    # -- commands and steps ---------------------------------------------------------------------

    def _apply(self, action: Action) -> None:
        state = self._world.step(action)
        if self._settings.pace > 0.0:
            delay_s = 1.0 / self._settings.pace
            self._timer = create_timer(self, delay_s, lambda: self._end_step(state))
        else:
            self._publish_step(state)

    def _end_step(self, state: State) -> None:
        self._stop_timer()
        self._publish_step(state)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def _occupation(self) -> str:
        if self._fault is not ErrorCode.NONE:
            return f"which ended with {self._fault.name}"
        return "" if self._timer is None else "which has its command"

    def _show(self, state: State, stamp: Time) -> None:
        if self._visualizer is not None:
            self._visualizer.show(state, stamp)

    # -- episodes -------------------------------------------------------------------------------

    def _reset(self, request: ResetTask.Request) -> None:
        if request.initial_state.objects:
            self._begin(self._given_task(request))
        else:
            self._begin(self._domain.task(request.seed, request.index))

    def _begin(self, task: Task) -> None:
        self._world = self._domain.make_world(task.initial_state)
        self._stop_timer()
        self._open_episode(task)

    def _given_task(self, request: ResetTask.Request) -> Task:
        initial = decode_state(request.initial_state, self._domain.types_by_name)
        self._require_objects(initial)
        space = self._domain.atom_space(initial)
        goal = decode_goal(request.goal, space)
        space.mask(goal)
        return Task(initial, goal or self._domain.default_goal(initial), self._domain.step_limit)

    def _require_objects(self, initial: State) -> None:
        """Refuse a state that lacks what every task of the domain has, or has two robots.

        Raises:
            InvalidStateError: It does.
        """
        sampled = self._domain.task(0).initial_state
        wanted = Counter(obj.type.name for obj in sampled.objects)
        found = Counter(obj.type.name for obj in initial.objects)
        robots = {kind.name for kind in self._domain.robot_types}
        for name, number in wanted.items():
            if found[name] == 0 or (name in robots and found[name] != number):
                raise InvalidStateError(
                    f"an initial state with {found[name]} objects of type {name}; a task of "
                    f"{self._domain.name} has {number}"
                )


def main() -> int:
    """Run the node."""
    return run_node("sim_node", SimNode)
