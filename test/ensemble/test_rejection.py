# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A skill server that accepts no goal ends the run with an error of its own."""

from rclpy.action import ActionServer, GoalResponse
from rclpy.node import Node

from ensemble.client import RunClient
from ensemble.interfaces import EXECUTE_SKILL, SKILL_EVENTS
from ensemble.launcher import InProcessLauncher
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.errors import ErrorCode
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import EnsembleBench


class RejectingServer(Node):
    """Looks like a skill server, and rejects every goal."""

    def __init__(self):
        super().__init__("skill_server")
        self.asked = []
        self.create_publisher(SKILL_EVENTS.type, SKILL_EVENTS.name, SKILL_EVENTS.qos)
        self._actions = ActionServer(
            self,
            EXECUTE_SKILL.type,
            EXECUTE_SKILL.name,
            lambda goal: EXECUTE_SKILL.type.Result(),
            goal_callback=self._reject,
        )

    def _reject(self, goal):
        self.asked.append(goal.edge.name)
        return GoalResponse.REJECT

    def destroy_node(self):
        self._actions.destroy()
        super().destroy_node()


def test_a_rejected_goal_ends_the_run_and_says_which(network):
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"), 3, 0, "lazy", None, shortcuts="none", patience=5.0
    )
    nodes = node_parameters(settings)
    del nodes["skill_server"]
    with temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner):
        server = RejectingServer()
        spinner.executor.add_node(server)
        try:
            with InProcessLauncher(nodes, spinner.executor):
                bench = EnsembleBench(client, spinner)
                bench.until(lambda: client.ready(recording=False))
                result = bench.solve(max_replans=5)
                bench.until(lambda: client.log.complete)
        finally:
            server.destroy_node()
    assert result.error_code == ErrorCode.SKILL_REJECTED
    (name,) = server.asked  # once: what is rejected is not a divergence
    assert f"rejected {name}(" in result.error_msg
    assert (result.success, result.plan_length, result.replans) == (False, 0, 0)
    (run,) = client.log.runs()
    assert run.error_code == ErrorCode.SKILL_REJECTED
