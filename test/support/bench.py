# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node of a test, and nodes in this process, on one executor: what a callback raises comes out.

Whatever is waited for must come.
"""

from contextlib import contextmanager

import rclpy
from rclpy.executors import SingleThreadedExecutor
from slap_msgs.srv import ResetTask

from ensemble.client import RunClient
from ensemble.interfaces import RESET_TASK
from ensemble.launcher import InProcessLauncher
from ensemble.spinner import Spinner, temporary_node

LIMIT = 120.0  # s, far more than anything here takes, on a loaded machine too


class Bench:
    """A node that asks others, and what spins it.

    Args:
        client: The node.
        spinner: Spins it, and whatever else is on its executor.
    """

    def __init__(self, client, spinner):
        self.client, self.spinner = client, spinner

    def until(self, condition):
        assert self.spinner.spin_until(condition, LIMIT), "hung"

    def result(self, future):
        self.until(future.done)
        return future.result()

    def call(self, service, request):
        """The response of a service, which is waited for."""
        client = self.client.create_client(service.type, service.name)
        self.until(client.service_is_ready)
        response = self.result(client.call_async(request))
        self.client.destroy_client(client)
        return response


class EnsembleBench(Bench):
    """A client that runs an ensemble; see :class:`ensemble.client.RunClient`."""

    def ask(self, episode=0, max_replans=2):
        """Ask for the task to be solved; the future of the action's answer."""
        handle = self.result(self.client.send((), 0, max_replans, episode))
        return handle.get_result_async()

    def solve(self, episode=0, max_replans=2):
        """What comes of asking for the task to be solved."""
        return self.result(self.ask(episode, max_replans)).result

    def reset(self, seed):
        """Open a new episode; its number."""
        response = self.call(RESET_TASK, ResetTask.Request(seed=seed))
        assert response.error_code == 0, response.error_msg
        return response.episode

    def close_bag(self):
        self.result(self.client.close_bag())


@contextmanager
def one_executor():
    """A list of nodes that are destroyed in the end, and a spinner of their executor."""
    rclpy.init()
    executor, nodes = SingleThreadedExecutor(), []
    try:
        yield nodes, Spinner(executor)
    finally:
        for node in reversed(nodes):
            node.destroy_node()
        executor.shutdown()
        rclpy.shutdown()


def solved_by(nodes):
    """What comes of the first task of an ensemble of these nodes, all in this process."""
    with (
        temporary_node(lambda: RunClient(lambda *_: None)) as (client, spinner),
        InProcessLauncher(nodes, spinner.executor),
    ):
        bench = EnsembleBench(client, spinner)
        bench.until(lambda: client.ready(recording=False))
        return bench.solve(max_replans=5)
