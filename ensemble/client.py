# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The user's side of a run: asks for the task to be solved and follows what happens."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.task import Future
from slap_msgs.action import SolveTask

from ensemble import encode
from ensemble.endpoints import subscribe
from ensemble.interfaces import (
    ATOMS,
    CLOSE_BAG,
    DOMAIN,
    EXECUTE_SKILL,
    JOINT_STATES,
    PLAN,
    PLAN_EVENTS,
    SKILL_EVENTS,
    SOLVE_TASK,
    STATE,
    TASK,
    Topic,
)
from ensemble.offered_qos import subscribe_as_offered
from slap_ros.evaluation.run_log import RunLog
from slap_ros.relational import GroundAtom

FOLLOWED = (DOMAIN, TASK, STATE, ATOMS, PLAN, PLAN_EVENTS, SKILL_EVENTS)
HIDDEN = "_"  # what the names of hidden nodes begin with
OnMessage = Callable[[str, Any], None]  # message type, message


class RunClient(Node):
    """Follows a run; ``log`` has its metrics.

    Subscribers:
        every topic of ``FOLLOWED``, and those asked for.

    Action clients:
        slap/solve_task (slap_msgs/SolveTask): the task.
        slap/execute_skill (slap_msgs/ExecuteSkill): only to see whether its server is there.

    Service clients:
        slap/close_bag (std_srvs/Trigger): finish the bag.
    """

    def __init__(self, on_message: OnMessage, shown: Collection[Topic] = (), **kwargs: Any) -> None:
        """Follow a run.

        Args:
            on_message: Called for every message followed, after the log has it.
            shown: Topics to follow besides those that the log needs.
            kwargs: The node's.
        """
        super().__init__("slap_run", **kwargs)
        self.log = RunLog()
        self.newest: dict[str, Any] = {}  # message of each type
        self._on_message = on_message
        for topic in (*FOLLOWED, *(topic for topic in shown if topic not in FOLLOWED)):
            self._follow(topic)
        self._solve = ActionClient(self, SOLVE_TASK.type, SOLVE_TASK.name)
        self._skills = ActionClient(self, EXECUTE_SKILL.type, EXECUTE_SKILL.name)
        self._close_bag = self.create_client(CLOSE_BAG.type, CLOSE_BAG.name)

    def destroy_node(self) -> None:
        """Destroy the action clients as well."""
        self._solve.destroy()
        self._skills.destroy()
        super().destroy_node()

    def _follow(self, topic: Topic) -> None:
        def callback(message: Any) -> None:
            self.newest[topic.type_name] = message
            self.log.add(topic.type_name, message)
            self._on_message(topic.type_name, message)

        if topic is JOINT_STATES:
            subscribe_as_offered(self, topic, callback)
        else:
            subscribe(self, topic, callback)

    def other_nodes(self) -> list[str]:
        """Names of the other nodes in this namespace, hidden ones left out.

        The ``ros2`` command's own nodes are hidden. Its daemon stays for hours after a command.
        """
        here = self.get_namespace()
        return [
            name
            for name, namespace in self.get_node_names_and_namespaces()
            if namespace == here and name != self.get_name() and not name.startswith(HIDDEN)
        ]

    def ready(self, recording: bool) -> bool:
        """Whether everything that a run needs is there, its domain imported."""
        return (
            self._solve.server_is_ready()
            and self.count_publishers(ATOMS.name) > 0
            and self._skills.server_is_ready()
            and (not recording or self._close_bag.service_is_ready())
        )

    def send(
        self,
        goal: Collection[GroundAtom],
        step_limit: int,
        max_replans: int,
        episode: int = 0,
    ) -> Future:
        """Ask for the task to be solved.

        Args:
            goal: Atoms to reach; empty for the task's own.
            step_limit: Environment steps; 0 for the task's own limit.
            max_replans: Plans after the first.
            episode: Number of the episode whose task is solved; 0 for the current episode.

        Returns:
            A future whose result is the goal handle.
        """
        request = SolveTask.Goal(
            episode=episode,
            goal=encode.goal(goal),
            step_limit=step_limit,
            max_replans=max_replans,
        )
        return self._solve.send_goal_async(request)

    def close_bag(self) -> Future:
        """Ask the recorder to finish its bag."""
        return self._close_bag.call_async(CLOSE_BAG.type.Request())
