# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which episode is under way, from the latched topics ``domain``, ``task`` and ``skills``."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Generic, TypeVar

from rclpy.node import Node
from slap_msgs.msg import DomainInfo, SkillLibrary
from slap_msgs.msg import Task as TaskMessage

from ensemble.answering import domain_error, error_to_answer
from ensemble.endpoints import subscribe
from ensemble.futures import run_in_executor
from ensemble.interfaces import DOMAIN, SKILLS, TASK
from ensemble.observation import Episode
from ensemble.refusals import Refusals
from ensemble.steady_time import create_timer
from slap_ros.acquisition.domain_choice import DomainChoice, open_domain
from slap_ros.core import Domain, Task
from slap_ros.errors import SlapError
from slap_ros.messages.decode import decode_goal, decode_state, stamp_ns

RIVAL_PERIOD = 1.0  # s, between two looks at whether another simulator is still there

Endpoint = tuple[int, ...]
T = TypeVar("T")  # what is prepared for an episode


class EpisodeTracker(Generic[T]):
    """Follows ``slap/domain``, ``slap/task`` and ``slap/skills``, which may arrive in any order.

    Whatever takes time, such as the import of a domain, is done in a thread. What cannot be used is
    refused: it is counted and logged, and the episode that is under way goes on. A library of
    skills is taken on with the first episode of a domain that is announced with its digest.
    """

    def __init__(
        self,
        node: Node,
        prepare: Callable[[Episode], T],
        on_episode: Callable[[Episode, T], None],
        refusals: Refusals,
        skills: str = "",
    ) -> None:
        """Follow both topics from now on.

        Args:
            node: Who subscribes.
            prepare: Called in a thread for each new episode; an episode for which it raises a
                SlapError is refused.
            on_episode: Called with each new episode, and with what was prepared for it.
            refusals: Where refused domains and tasks are counted.
            skills: What the node was given: domains with others are refused; empty: none is.
        """
        self.current: Episode | None = None
        self.refusal: SlapError | None = None  # why the newest task, or its domain, was refused
        self._node, self._refusals = node, refusals
        self._prepare, self._on_episode = prepare, on_episode
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="episode")
        self._skills = skills
        self._choices: dict[str, DomainChoice] = {}  # by name: the newest that was opened
        self._domains: dict[str, Domain] = {}  # by name: what it stands for
        self._folders: dict[str, str] = {}  # of libraries that were acquired, by digest
        self._domain: DomainInfo | None = None  # the newest
        self._task: TaskMessage | None = None  # the newest that is not a rival's
        self._opened: TaskMessage | None = None  # the task of the current episode
        self._simulator: frozenset[Endpoint] = frozenset()  # which publish tasks
        self._rival: tuple[TaskMessage, frozenset[Endpoint]] | None = None  # another simulator's
        subscribe(node, SKILLS, self._on_skills)
        subscribe(node, DOMAIN, self._on_domain)
        subscribe(node, TASK, self._on_task)
        create_timer(node, RIVAL_PERIOD, self._check_rival)

    def destroy(self) -> None:
        """Stop the thread."""
        self._workers.shutdown(wait=False, cancel_futures=True)

    # What is latched is sent again when two nodes find each other again after a moment of silence.
    # That is no new episode.

    def _on_domain(self, message: DomainInfo) -> None:
        if message != self._domain:
            self._domain = message
            self._start(self._load(message))

    def _on_skills(self, message: SkillLibrary) -> None:
        known = message.digest in self._folders
        self._folders[message.digest] = message.folder
        if not known and self._domain is not None:  # it may have been refused without
            self._start(self._load(self._domain))

    def _on_task(self, message: TaskMessage) -> None:
        if message == self._task:
            return
        if reason := self._rivalry(message):
            endpoints = frozenset(self._publishers())
            self._rival = message, endpoints - self._simulator or endpoints
            self._refusals.add("refused_tasks", reason)
            return
        self._task, self._rival = message, None
        if message.domain in self._domains:
            self._start(self._open(message))

    @property
    def library_folder(self) -> Path | None:
        """Of the skills that the current domain has; None where they are of no library."""
        choice = self._choices.get(self.current.domain.name) if self.current else None
        return choice.library_folder if choice else None

    def _start(self, work: Coroutine[None, None, None]) -> None:
        self._node.executor.create_task(work)

    async def _load(self, message: DomainInfo) -> None:
        """Import a domain, and open the episode that waits for it."""
        try:
            choice = self._announced(message)
            if self._choices.get(choice.name) == choice:
                return
            # Its next task must not be opened with the skills that it had before.
            self._domains.pop(choice.name, None)
            self._choices.pop(choice.name, None)
            domain = await run_in_executor(self._workers, lambda: open_domain(choice))
        except Exception as raised:  # of a domain's code
            self._refuse("refused_domains", error_to_answer(self._node, raised))
            return
        if self._choices.get(choice.name) == choice:
            return  # announced twice meanwhile
        self._choices[choice.name], self._domains[choice.name] = choice, domain
        task = self._task
        if task is not None and task.domain == choice.name and task is not self._opened:
            await self._open(task)

    def _announced(self, message: DomainInfo) -> DomainChoice:
        """The domain to be opened.

        Raises:
            SkillsChangedError: This node was given other skills.
            InvalidParameterError: Skills that are not known here.
        """
        choice = DomainChoice.announced(message)
        if choice.digest in self._folders:
            return replace(choice, skills=self._folders[choice.digest])
        return choice.with_skills_of(self._node.get_name(), self._skills)

    async def _open(self, message: TaskMessage) -> None:
        domain = self._domains.get(message.domain)
        if domain is None:  # announced with other skills meanwhile: opened once they are loaded
            return
        try:
            episode, prepared = await run_in_executor(
                self._workers, lambda: self._made(message, domain)
            )
        except Exception as raised:  # of a domain's code
            self._refuse("refused_tasks", domain_error(self._node, domain.name, raised))
            return
        # One that was overtaken meanwhile is opened all the same: what overtook it may be refused.
        if message is self._task or self._opened is not self._task:
            self.current, self.refusal, self._opened = episode, None, message
            self._simulator = frozenset(self._publishers())
            self._on_episode(episode, prepared)

    def _made(self, message: TaskMessage, domain: Domain) -> tuple[Episode, T]:
        initial = decode_state(message.initial_state, domain.types_by_name)
        space = domain.atom_space(initial)
        task = Task(initial, decode_goal(message.goal, space), message.step_limit)
        episode = Episode(message.episode, stamp_ns(message.header), domain, task, space)
        return episode, self._prepare(episode)

    def _refuse(self, kind: str, error: SlapError) -> None:
        self._refusals.add(kind, error)
        self.refusal = error

    # A simulator that was started again with another domain looks like a second one until DDS has
    # missed the first.

    def _rivalry(self, message: TaskMessage) -> str | None:
        """Why a task is another simulator's; None where it is not, as far as can be told."""
        current, publishers = self.current, self._publishers()
        if current is None or message.domain == current.domain.name:
            return None
        if len(publishers) < 2 or self._simulator.isdisjoint(publishers):
            return None
        return (
            f"a task of {message.domain!r} refused, as one of {current.domain.name} is under way: "
            f"{' and '.join(sorted(publishers.values()))} publish tasks on this network. Stop one "
            "of them, or give it another ROS_DOMAIN_ID or namespace"
        )

    def _check_rival(self) -> None:
        """Follow another simulator once the first is gone; forget it if it is gone itself."""
        if self._rival is None:
            return
        message, endpoints = self._rival
        publishers = self._publishers()
        if endpoints.isdisjoint(publishers):
            self._rival = None
        elif self._simulator.isdisjoint(publishers):
            self._on_task(message)

    def _publishers(self) -> dict[Endpoint, str]:
        """Names of the nodes that publish tasks, by their endpoints."""
        topic = self._node.resolve_topic_name(TASK.name)
        return {
            tuple(info.endpoint_gid): f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in self._node.get_publishers_info_by_topic(topic)
        }
