# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An ensemble each of whose nodes may be killed and started again, and a client that goes on."""

from contextlib import contextmanager

from ensemble.client import RunClient
from ensemble.interfaces import ATOMS, PLAN_EVENTS, SKILL_EVENTS, STATE
from ensemble.launcher import ProcessLauncher
from ensemble.node_liveness import NodeLiveness
from ensemble.nodes import RunSettings, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.skills.domain_choice import DomainChoice
from support.bench import EnsembleBench

# By which a node is told from its successor.
PUBLISHED = {
    "sim_node": STATE,
    "perception_node": ATOMS,
    "skill_server": SKILL_EVENTS,
    "planner_node": PLAN_EVENTS,
}


class LivingEnsemble(EnsembleBench):
    """An ensemble whose nodes come and go, and a client."""

    def __init__(self, nodes, client, spinner, heard):
        super().__init__(client, spinner)
        self.nodes, self.heard = nodes, heard
        self._launchers = {}

    def start(self, name, **changed):
        self._launchers[name] = ProcessLauncher({name: {**self.nodes[name], **changed}})
        self._launchers[name].__enter__()

    def kill(self, name):
        process = self._launchers[name].processes[name]
        process.kill()
        process.wait()

    def restart(self, name, **changed):
        """Kill it, start it again, and wait until nobody takes it for its predecessor."""
        old = NodeLiveness(self.client, PUBLISHED[name]) if name in PUBLISHED else None
        self.kill(name)
        if old is None:
            self.until(lambda: name not in self.client.other_nodes())
        self.start(name, **changed)
        self.until(lambda: (old is None or old.is_lost()) and self.client.ready(True))

    def told(self, type_name):
        """The messages of a type so far."""
        return [message for name, message in self.heard if name == type_name]

    def stop(self):
        for launcher in self._launchers.values():
            launcher.__exit__(None, None, None)


@contextmanager
def laboratory(seed, bag, pace, patience=1.0):
    """An ensemble on a task, at so many steps a second; ``bag`` may be None."""
    settings = RunSettings(
        DomainChoice("obstacle2d", "fair"),
        seed,
        0,
        "lazy",
        bag,
        pace=pace,
        shortcuts="none",
        patience=patience,
    )
    heard = []

    def client_node():
        return RunClient(lambda type_name, message: heard.append((type_name, message)))

    with temporary_node(client_node) as (client, spinner):
        bench = LivingEnsemble(node_parameters(settings), client, spinner, heard)
        try:
            for name in bench.nodes:
                bench.start(name)
            bench.until(lambda: client.ready(bag is not None))
            yield bench
        finally:
            bench.stop()
