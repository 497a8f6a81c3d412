# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Environments in several processes: most of the time of learning is spent stepping worlds.

What is learned depends on the parts that the environments are divided into, never on how many
processes share the parts: each part draws from a generator of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import fields
from multiprocessing.connection import Connection
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.learning.linked_process import linked_process, receive, send
from slap_ros.learning.vec_env import VecEnv, VecEnvShape, VecEnvStep
from slap_ros.relational.state import Array


class VecEnvSpec(VecEnvShape, Protocol):
    """What environments are made from, as data that other processes can be sent."""

    def make(self) -> VecEnv:
        """The environments themselves, in this process."""
        ...


class SubprocVecEnv:
    """Environments alike in horizon and actions, in processes of their own, as one."""

    def __init__(self, links: Sequence[Connection], shares: Sequence[Sequence[VecEnvSpec]]) -> None:
        """Wait for the first observations.

        Args:
            links: Connections to each process.
            shares: Specifications of the environments that each process steps.

        Raises:
            ChildProcessError: One of the processes has ended.
        """
        first = shares[0][0]
        self.horizon = first.horizon
        self.action_map = first.action_map
        self._links = links
        sizes = [sum(spec.num_envs for spec in share) for share in shares]
        self.num_envs, self._bounds = sum(sizes), np.cumsum(sizes)[:-1]
        self.observations: NDArray[np.float32] = np.concatenate(self._receive_all())

    def step(self, actions: Array) -> VecEnvStep:
        """See :meth:`slap_ros.learning.vec_env.VecEnv.step`.

        Raises:
            ChildProcessError: One of the processes has ended.
        """
        for link, share in zip(self._links, np.split(actions, self._bounds), strict=True):
            send(link, share)
        step = concatenated(self._receive_all())
        self.observations = step.observations
        return step

    def _receive_all(self) -> list[Any]:
        return [receive(link) for link in self._links]


@contextmanager
def make_vec_env(specs: Sequence[VecEnvSpec], processes: int) -> Iterator[VecEnv]:
    """All parts as one vectorised environment; a single part runs in this process.

    Args:
        specs: Parts of the environment, alike in horizon and actions.
        processes: Number of processes at most; they end with the context.

    Raises:
        ChildProcessError: One of the processes has ended before.
    """
    if len(specs) == 1:
        yield specs[0].make()
        return
    numbers = np.array_split(np.arange(len(specs)), min(processes, len(specs)))
    shares = [[specs[i] for i in share] for share in numbers]
    with ExitStack() as stack:
        links = [stack.enter_context(linked_process(_step_until_closed, share)) for share in shares]
        yield SubprocVecEnv(links, shares)


def _step_until_closed(link: Connection, specs: Sequence[VecEnvSpec]) -> None:
    """Step environments in a process of their own, until the other end of the link is closed."""
    envs = [spec.make() for spec in specs]
    bounds = np.cumsum([env.num_envs for env in envs])[:-1]
    link.send(np.concatenate([env.observations for env in envs]))
    while True:
        parts = zip(envs, np.split(link.recv(), bounds), strict=True)
        link.send(concatenated([env.step(actions) for env, actions in parts]))


def concatenated(steps: Sequence[VecEnvStep]) -> VecEnvStep:
    """The steps of several environments as one."""
    kind = type(steps[0])  # it may be a step with more than every environment has
    return kind(
        *(np.concatenate([getattr(step, field.name) for step in steps]) for field in fields(kind))
    )
