# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two ensembles on one network: namespaces or domain ids keep them apart."""

import os
import subprocess
import sys
from collections import Counter
from contextlib import ExitStack

import pytest
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.interfaces import DIAGNOSTICS
from ensemble.nodes import RunSettings, node_class, node_parameters
from ensemble.spinner import temporary_node
from slap_ros.bags import evaluate_bag, read_bag
from slap_ros.domains import get_domain
from slap_ros.evaluation.experiment import Experiment
from slap_ros.skills.domain_choice import DomainChoice

NODES = ("sim_node", "perception_node", "skill_server", "planner_node", "recorder_node")
# Of every node of ROS 2, wherever it is; nothing of an ensemble is on these.
GLOBAL = {"/rosout", "/parameter_events"}
LIMIT = 120.0  # s, far more than anything here takes
PATIENCE = 5.0  # for a loaded machine
SEEDS = {"left": 3, "right": 4}


def alone(seed):
    """The length of the plan where there is no other ensemble."""
    return Experiment(get_domain("obstacle2d"), tasks=1, seeds=1).run(seed, 0).plan_length


@pytest.mark.slow
@pytest.mark.timeout(180)  # two ensembles at once
def test_namespaces_keep_two_ensembles_apart(network, tmp_path):
    alive = {side: {f"/{side}/{name}" for name in NODES} for side in SEEDS}
    heard = {side: set() for side in SEEDS}
    with ExitStack() as stack:
        left, spinner = stack.enter_context(temporary_node(lambda: client_of("left", heard)))
        clients = {"left": left, "right": client_of("right", heard)}
        stack.callback(clients["right"].destroy_node)
        spinner.executor.add_node(clients["right"])
        for side, seed in SEEDS.items():
            bag = tmp_path / side
            settings = RunSettings(
                DomainChoice("obstacle2d", "fair"),
                seed,
                0,
                "lazy",
                bag,
                shortcuts="none",
                patience=PATIENCE,
            )
            for node in ensemble(side, settings):
                stack.callback(node.destroy_node)
                spinner.executor.add_node(node)
        both = clients.values()
        assert spinner.spin_until(lambda: all(client.ready(True) for client in both), LIMIT)
        for nodes in heard.values():
            nodes.clear()  # what the recorders may have missed
        handles = answers(spinner, [client.send((), 0, 5) for client in both])
        results = answers(spinner, [handle.get_result_async() for handle in handles])
        assert spinner.spin_until(lambda: all(heard[side] >= alive[side] for side in SEEDS), LIMIT)
        names = [name for name, _ in left.get_topic_names_and_types()]
        names += [name for name, _ in left.get_service_names_and_types()]
        answers(spinner, [client.close_bag() for client in both])
    assert len(names) > 100  # actions are topics and services too
    assert {name.split("/")[1] for name in set(names) - GLOBAL} == {"left", "right"}
    assert heard == alive
    lengths = {side: r.result.plan_length for side, r in zip(SEEDS, results, strict=True)}
    for side, seed in SEEDS.items():
        found = evaluate_bag(tmp_path / side)
        assert [(run.seed, run.success) for run in found.runs] == [(seed, True)]
        assert lengths[side] == found.runs[0].plan_length == alone(seed)
        assert found.states == lengths[side] + 1
        topics = Counter(message.topic for message in read_bag(tmp_path / side))
        assert {topic.split("/")[1] for topic in topics} == {side}
        assert 0 < topics[f"/{side}/tf"] <= found.states  # frames do not wait for a recorder
        assert speakers(tmp_path / side) == alive[side]


def client_of(side, heard):
    """A client that notes whose heart beats."""

    def on_message(type_name, message):
        if type_name == DIAGNOSTICS.type_name:
            heard[side].update(status.name for status in message.status)

    return RunClient(on_message, [DIAGNOSTICS], namespace=f"/{side}")


def speakers(bag):
    """Whose heartbeats were recorded."""
    return {
        status.name
        for _, type_name, _, message in read_bag(bag)
        if type_name == DIAGNOSTICS.type_name
        for status in message.status
    }


def answers(spinner, futures):
    assert spinner.spin_until(lambda: all(future.done() for future in futures), LIMIT)
    return [future.result() for future in futures]


def ensemble(namespace, settings):
    for name, parameters in node_parameters(settings).items():
        yield node_class(name)(
            parameter_overrides=[Parameter(key, value=value) for key, value in parameters.items()],
            namespace=f"/{namespace}",
        )


@pytest.mark.slow
@pytest.mark.timeout(240)  # starts two ensembles, each node a process
def test_domain_ids_keep_two_ensembles_apart(network, other_network, tmp_path):
    runs = {
        side: subprocess.Popen(
            [sys.executable, "-m", "ensemble.cli", "run", "obstacle2d", "--shortcuts", "none",
             "--seed", str(seed), "--record", str(tmp_path / side), "--patience", str(PATIENCE)],
            env=os.environ | {"ROS_DOMAIN_ID": str(number)},
            stderr=subprocess.PIPE,
            text=True,
        )
        for number, (side, seed) in zip((network, other_network), SEEDS.items(), strict=True)
    }  # fmt: skip
    for side, run in runs.items():
        _, said = run.communicate(timeout=2 * LIMIT)
        assert run.returncode == 0, said
        found = evaluate_bag(tmp_path / side)
        assert [(run.seed, run.plan_length) for run in found.runs] == [
            (SEEDS[side], alone(SEEDS[side]))
        ]
