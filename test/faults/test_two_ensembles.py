# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two ensembles on one network: namespaces or domain ids keep them apart."""

import os
import subprocess
import sys
from contextlib import ExitStack
from importlib import import_module

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from ensemble.client import RunClient
from ensemble.nodes import CLASSES, RunSettings, node_parameters
from ensemble.run import Spinner
from slap_ros.bags import evaluate_bag
from slap_ros.domains import get_domain
from slap_ros.evaluation.experiment import Experiment

LIMIT = 60.0  # s, far more than anything here takes
SEEDS = {"left": 3, "right": 4}


def alone(seed):
    """The length of the plan where there is no other ensemble."""
    return Experiment(get_domain("obstacle2d"), tasks=1, seeds=1).run(seed, 0).plan_length


def test_namespaces_keep_two_ensembles_apart(network, tmp_path):
    with ExitStack() as stack:
        rclpy.init()
        stack.callback(rclpy.shutdown)
        executor = SingleThreadedExecutor()
        stack.callback(executor.shutdown)
        clients = {}
        for side, seed in SEEDS.items():
            clients[side] = RunClient(lambda *_: None, namespace=f"/{side}")
            bag = tmp_path / side
            settings = RunSettings("obstacle2d", "fair", seed, 0, "lazy", bag, shortcuts="none")
            for node in (clients[side], *ensemble(side, settings)):
                stack.callback(node.destroy_node)
                executor.add_node(node)
        spinner = Spinner(executor)
        both = clients.values()
        assert spinner.until(lambda: all(client.ready(True) for client in both), LIMIT)
        handles = answers(spinner, [client.send((), 0, 5) for client in both])
        results = answers(spinner, [handle.get_result_async() for handle in handles])
        answers(spinner, [client.close_bag() for client in both])
    lengths = {side: r.result.plan_length for side, r in zip(SEEDS, results, strict=True)}
    for side, seed in SEEDS.items():
        found = evaluate_bag(tmp_path / side)
        assert [(run.seed, run.success) for run in found.runs] == [(seed, True)]
        assert lengths[side] == found.runs[0].plan_length == alone(seed)
        assert found.states == lengths[side] + 1


def answers(spinner, futures):
    assert spinner.until(lambda: all(future.done() for future in futures), LIMIT)
    return [future.result() for future in futures]


def ensemble(namespace, settings):
    for name, parameters in node_parameters(settings).items():
        yield getattr(import_module(f"{name}.node"), CLASSES[name])(
            parameter_overrides=[Parameter(key, value=value) for key, value in parameters.items()],
            namespace=f"/{namespace}",
        )


def test_domain_ids_keep_two_ensembles_apart(network, tmp_path):
    runs = {
        side: subprocess.Popen(
            [sys.executable, "-m", "slap_ros.cli", "run", "obstacle2d", "--shortcuts", "none",
             "--seed", str(seed), "--record", str(tmp_path / side)],
            env=os.environ | {"ROS_DOMAIN_ID": str(network + 50 * number)},
            stderr=subprocess.PIPE,
            text=True,
        )
        for number, (side, seed) in enumerate(SEEDS.items())
    }  # fmt: skip
    for side, run in runs.items():
        _, said = run.communicate(timeout=2 * LIMIT)
        assert run.returncode == 0, said
        found = evaluate_bag(tmp_path / side)
        assert [(run.seed, run.plan_length) for run in found.runs] == [
            (SEEDS[side], alone(SEEDS[side]))
        ]
