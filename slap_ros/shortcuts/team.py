# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Practice in several processes: most of learning's time is spent stepping worlds.

What is learned depends on the parts that practice is made of, never on how many processes share
them: each part draws from a generator of its own.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, fields
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slap_ros.domains import get_domain
from slap_ros.errors import SlapError
from slap_ros.relational.state import Array
from slap_ros.shortcuts.action_map import ActionMap
from slap_ros.shortcuts.practice import Episodes, Practice, Rewards, Steps
from slap_ros.shortcuts.sight import action_map
from slap_ros.shortcuts.signature import Signature
from slap_ros.shortcuts.starts import StartRecord, recall
from slap_ros.shortcuts.workers import end_with

PATIENCE_S = 5.0  # for a process to end by itself
GONE = (EOFError, ConnectionError)  # what a link says whose other end is no more


@dataclass(frozen=True)
class Exercise:
    """A part of the practice, as plain data. See :class:`Practice`."""

    domain: str
    preset: str
    signature: Signature
    starts: tuple[StartRecord, ...]
    episodes: int
    horizon: int
    rewards: Rewards
    seed: tuple[int, ...]

    def begin(self) -> Practice:
        """The practice itself."""
        domain, rng = get_domain(self.domain, self.preset), np.random.default_rng(self.seed)
        starts = recall(domain, self.starts)
        return Practice(
            domain, self.signature, starts, self.episodes, self.horizon, self.rewards, rng
        )


class Team:
    """Practices alike in horizon and actions, in processes of their own, as if they were one."""

    def __init__(
        self, links: Sequence[Connection], exercises: Sequence[Sequence[Exercise]]
    ) -> None:
        """Wait for them to begin.

        Args:
            links: To each process.
            exercises: What each of them does.

        Raises:
            ChildProcessError: One of them is no more.
        """
        first = exercises[0][0]
        self.horizon = first.horizon
        domain = get_domain(first.domain, first.preset)
        self.actions: ActionMap = action_map(domain, first.signature)
        self._links = links
        sizes = [sum(one.episodes for one in share) for share in exercises]
        self.episodes, self._bounds = sum(sizes), np.cumsum(sizes)[:-1]
        self.observations: NDArray[np.float32] = np.concatenate(self._answers())

    def step(self, actions: Array) -> Steps:
        """See :meth:`Practice.step`.

        Raises:
            ChildProcessError: One of the processes is no more.
        """
        for link, share in zip(self._links, np.split(actions, self._bounds), strict=True):
            with suppress(ConnectionError):  # told when its answer is missing
                link.send(share)
        steps = _together(self._answers())
        self.observations = steps.observations
        return steps

    def _answers(self) -> list[Any]:
        return [_answer(link) for link in self._links]


@contextmanager
def practising(exercises: Sequence[Exercise], processes: int) -> Iterator[Episodes]:
    """All of these exercises, in so many processes at most, which end with it; one alone is here.

    Raises:
        ChildProcessError: One of the processes is no more.
    """
    if len(exercises) == 1:
        yield exercises[0].begin()
        return
    context = get_context("spawn")  # physics clients do not survive a fork
    numbers = np.array_split(np.arange(len(exercises)), min(processes, len(exercises)))
    shares = [[exercises[i] for i in share] for share in numbers]
    with ExitStack() as stack:
        links = []
        for share in shares:
            mine, theirs = context.Pipe()
            process = context.Process(target=_practise, args=(theirs, share, os.getpid()))
            process.start()
            theirs.close()  # or nobody would notice its end
            stack.callback(_end, process, mine)
            links.append(mine)
        yield Team(links, shares)


def _end(process: BaseProcess, link: Connection) -> None:
    link.close()
    process.join(PATIENCE_S)
    process.kill()
    process.join()


def _practise(link: Connection, exercises: Sequence[Exercise], parent: int) -> None:
    """What such a process does, until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # its parent will see to it
    end_with(parent)
    try:
        practices = [exercise.begin() for exercise in exercises]
        bounds = np.cumsum([practice.episodes for practice in practices])[:-1]
        link.send(np.concatenate([practice.observations for practice in practices]))
        while True:
            parts = zip(practices, np.split(link.recv(), bounds), strict=True)
            link.send(_together([practice.step(actions) for practice, actions in parts]))
    except GONE:
        return
    except SlapError as error:
        link.send(error)


def _answer(link: Connection) -> Any:
    try:
        answer = link.recv()
    except GONE as error:
        raise ChildProcessError(
            "a process that stepped worlds ended; if it was killed for memory, use fewer --jobs"
        ) from error
    if isinstance(answer, SlapError):
        raise answer
    return answer


def _together(steps: Sequence[Steps]) -> Steps:
    return Steps(
        *(np.concatenate([getattr(one, field.name) for one in steps]) for field in fields(Steps))
    )
