# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starts an ensemble's nodes: each in a process of its own, or all in this one."""

from __future__ import annotations

import json
import signal
from collections.abc import Mapping
from typing import Protocol, Self

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter

from ensemble.node_process import ForkServer, NodeProcess
from ensemble.nodes import node_class
from slap_ros.errors import ErrorCode, NodeDiedError

KNOWN_CODES = frozenset(int(code) for code in ErrorCode if code > ErrorCode.UNKNOWN)

NodeParameters = Mapping[str, Mapping[str, str | int | float]]


class NodeLauncher(Protocol):
    """Runs an ensemble from entering to leaving the context."""

    def check(self) -> None:
        """Check that every node still runs.

        Raises:
            NodeDiedError: One has ended.
        """
        ...

    def require(self, name: str) -> None:
        """Check that one node still runs.

        Raises:
            NodeDiedError: It has ended.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


class ProcessLauncher:
    """Runs each node as a process. None outlives this one, however it ends."""

    def __init__(self, nodes: NodeParameters, server: ForkServer | None = None) -> None:
        """Run nodes from entering on.

        Args:
            nodes: Their parameters by name.
            server: What makes their processes; None for one of its own.
        """
        self._nodes = nodes
        self._server = server or ForkServer(nodes)
        self.processes: dict[str, NodeProcess] = {}

    def __enter__(self) -> Self:
        try:
            for name, parameters in self._nodes.items():
                self.processes[name] = self._server.run(_arguments(name, parameters))
        except BaseException:
            self._stop()
            raise
        return self

    def check(self) -> None:
        """See :class:`NodeLauncher`."""
        for name in self.processes:
            self.require(name)

    def require(self, name: str) -> None:
        """See :class:`NodeLauncher`. The error's code is the node's own exit code, if it is one."""
        code = self.processes[name].poll()
        if code is not None:
            raise _died(name, code)

    def __exit__(self, *_: object) -> None:
        self._stop()

    def _stop(self) -> None:
        # SIGTERM rather than SIGINT: it also ends a node quietly that is still importing.
        with self._server:
            for process in self.processes.values():
                process.terminate()
            for process in self.processes.values():
                process.wait()


def _arguments(name: str, parameters: Mapping[str, str | int | float]) -> list[str]:
    arguments = [name, "--ros-args", "--log-level", "warn"]
    for key, value in parameters.items():
        arguments += ["-p", f"{key}:={_as_yaml(value)}"]
    return arguments


def _as_yaml(value: str | int | float | tuple[float, ...]) -> str:
    """A parameter's value as ROS reads it: texts quoted, or ``2024`` and ``x #y`` are others."""
    if isinstance(value, str | bool):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_as_yaml, value))}]"
    text = str(value)
    return text if "." in text else text.replace("e", ".0e")  # 1e-12 is a text in YAML


def _died(name: str, code: int) -> NodeDiedError:
    if code < 0:
        return NodeDiedError(f"{name} was killed by {signal.Signals(-code).name}")
    if code in KNOWN_CODES:
        cause = ErrorCode(code)
        return NodeDiedError(f"{name} ended: {cause.name}, see its message above", cause)
    return NodeDiedError(f"{name} ended with exit code {code}, see its messages above")


class InProcessLauncher:
    """Runs every node in this process, on one executor."""

    def __init__(self, nodes: NodeParameters, executor: Executor) -> None:
        """Run nodes, given their parameters by name, on an executor that the caller spins."""
        self._nodes = nodes
        self._executor = executor
        self._made: list[Node] = []

    def __enter__(self) -> Self:
        try:
            for name, parameters in self._nodes.items():
                self._made.append(_make(name, parameters))
                self._executor.add_node(self._made[-1])
        except BaseException:
            self._destroy()
            raise
        return self

    def check(self) -> None:
        """Nothing to check: errors of nodes come out of the executor."""

    def require(self, name: str) -> None:
        """Nothing to check, as above."""

    def __exit__(self, *_: object) -> None:
        self._destroy()

    def _destroy(self) -> None:
        for node in self._made:
            self._executor.remove_node(node)
            node.destroy_node()
        self._made.clear()


def _make(name: str, parameters: Mapping[str, str | int | float]) -> Node:
    overrides = [Parameter(key, value=value) for key, value in parameters.items()]
    node: Node = node_class(name)(parameter_overrides=overrides)
    return node
