# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which episode is under way, from the latched topics ``domain``, ``task`` and ``skills``."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path
from time import monotonic
from typing import Generic, NamedTuple, TypeVar

from rclpy.node import Node
from slap_msgs.msg import DomainInfo, SkillLibrary
from slap_msgs.msg import Task as TaskMessage

from ensemble.announced_libraries import AnnouncedLibraries
from ensemble.answering import domain_error, error_to_answer
from ensemble.common_parameters import DEFAULTS, CommonParameters
from ensemble.domain_announcements import DomainAnnouncements
from ensemble.endpoints import subscribe
from ensemble.futures import run_in_executor
from ensemble.interfaces import DOMAIN, SKILLS, TASK
from ensemble.observation import Episode
from ensemble.refusals import Refusals
from ensemble.steady_time import create_timer
from slap_ros.core import Domain, Task
from slap_ros.domains import domain_names, preset_names
from slap_ros.domains.variation import parse_preset
from slap_ros.errors import (
    InvalidLibraryError,
    InvalidParameterError,
    SkillsChangedError,
    SlapError,
    UnknownDomainError,
)
from slap_ros.messages.decode import decode_goal, decode_state, stamp_ns
from slap_ros.messages.protocols import StateMessage
from slap_ros.skills.domain_choice import DomainChoice, open_domain

RIVAL_PERIOD = 1.0  # s, between two looks at whether another simulator is still there
LOOK_PERIOD = 0.5  # s, between two looks at who publishes tasks, which cost time
WAITING = 16  # tasks that wait to be opened
OPENED = 8  # domains that stay open
UNUSABLE = 256  # domains that are not tried again

Endpoint = tuple[int, ...]
T = TypeVar("T")  # what is prepared for an episode


class OpenedDomain(NamedTuple):
    """A domain, and the choice by which it was opened."""

    choice: DomainChoice
    domain: Domain


class EpisodeTracker(Generic[T]):
    """Follows ``slap/domain``, ``slap/task`` and ``slap/skills``, which may arrive in any order.

    A task opens an episode. The import of its domain, and whatever else takes time, is done in a
    thread, for one task at a time. What cannot be used is refused: it is counted and logged, and
    the episode that is under way goes on. Strangers may publish on all three topics, so what waits
    is bounded. A domain is imported ahead only until there was a first task.
    """

    def __init__(
        self,
        node: Node,
        prepare: Callable[[Episode], T],
        on_episode: Callable[[Episode, T], None],
        refusals: Refusals,
        common: CommonParameters = DEFAULTS,
    ) -> None:
        """Follow the topics from now on.

        Args:
            node: Node that subscribes.
            prepare: Called in a thread for each new episode; an episode for which it raises a
                SlapError is refused.
            on_episode: Called with each new episode, and with what was prepared for it.
            refusals: Where refused domains, tasks and libraries are counted.
            common: Parameters of the node: skills that it was given, so that domains with others
                are refused, and folders below which announced libraries may lie.
        """
        self.current: Episode | None = None
        self.opened: TaskMessage | None = None  # the task of the current episode
        self.refusal: SlapError | None = None  # why the newest task, or its domain, was refused
        self._node, self._refusals = node, refusals
        self._prepare, self._on_episode = prepare, on_episode
        self._workers = ThreadPoolExecutor(1, thread_name_prefix="episode")
        self._skills = common.skills
        self._libraries = AnnouncedLibraries(common.libraries)
        self._names = frozenset(domain_names())
        self._announced = DomainAnnouncements()
        self._unusable: set[DomainChoice] = set()  # those that were tried in vain
        self._domains: OrderedDict[DomainChoice, OpenedDomain] = OrderedDict()  # as announced
        self._choice: DomainChoice | None = None  # of the current episode, as announced
        self._task: TaskMessage | None = None  # the newest that is not a rival's
        self._waiting: list[TaskMessage] = []  # in the order in which they came
        self._opening = False
        self._simulator: frozenset[Endpoint] = frozenset()  # which publish tasks
        self._rival: tuple[TaskMessage, frozenset[Endpoint]] | None = None  # another simulator's
        self._seen: dict[Endpoint, str] = {}  # which published tasks when last looked
        self._looked_s = -inf
        subscribe(node, SKILLS, self._on_skills)
        subscribe(node, DOMAIN, self._on_domain)
        subscribe(node, TASK, self._on_task)
        create_timer(node, RIVAL_PERIOD, self._check_rival)

    def destroy(self) -> None:
        """Stop the thread."""
        self._workers.shutdown(wait=False, cancel_futures=True)

    @property
    def library_folder(self) -> Path | None:
        """Of the skills that the current domain has; None where they are of no library."""
        if self._choice is None:
            return None
        return self._domains[self._choice].choice.library_folder

    def expects(self, message: StateMessage) -> bool:
        """Whether a message is of an episode whose task is here, but not opened yet."""
        return any(task.episode == message.episode for task in self._waiting)

    # What is latched is sent again when two nodes find each other again after a moment of silence.
    # That is no new episode.

    def _on_domain(self, message: DomainInfo) -> None:
        stamp = stamp_ns(message.header)
        try:
            if message.name not in self._names:
                raise UnknownDomainError(
                    f"unknown domain {message.name!r}; there are {', '.join(sorted(self._names))}"
                )
            choice = DomainChoice.announced(message)
            self._require_preset(choice)
        except SlapError as error:
            self._refuse("refused_domains", error)
            return
        if not self._announced.add(choice, stamp):
            return
        self._unusable.discard(choice)  # it may be usable now
        self._announced.trim(self._choice)
        self._correct()
        self._open_waiting()

    def _require_preset(self, choice: DomainChoice) -> None:
        """Refuse a preset that there is not, where that costs no import.

        Raises:
            InvalidParameterError: There is none of that name.
        """
        if choice.preset and any(choice.name == opened.name for opened in self._domains):
            name, _ = parse_preset(choice.preset)
            if name not in (presets := preset_names(choice.name)):
                raise InvalidParameterError(
                    f"{choice.name} has no preset {name!r}; there are {', '.join(presets)}"
                )

    def _correct(self) -> None:
        """Open the current task again if it was opened before its own announcement came."""
        opened = self.opened
        if opened is None or self._choice is None:
            return
        own = self._own_domains(opened)
        if own and self._choice not in own and opened not in self._waiting:
            self._waiting.append(opened)

    def _own_domains(self, message: TaskMessage) -> list[DomainChoice]:
        """The domain that was announced for a task, with its stamp; more if strangers did so."""
        return self._announced.with_stamp(message.domain, stamp_ns(message.header))

    def _on_skills(self, message: SkillLibrary) -> None:
        try:
            is_new = self._libraries.add(message)
        except SlapError as error:
            self._refusals.add("refused_skills", error)
            return
        if is_new:  # a domain may have been refused without
            self._unusable.clear()
            self._open_waiting()

    def _on_task(self, message: TaskMessage) -> None:
        if message == self._task:
            return
        if reason := self._why_not(message):
            self._refuse_task(reason)
            return
        if reason := self._rivalry(message):
            endpoints = frozenset(self._publishers_lately())
            self._rival = message, endpoints - self._simulator or endpoints
            self._refusals.add("refused_tasks", reason)
            return
        self._task, self._rival = message, None
        self._waiting.append(message)
        if len(self._waiting) > WAITING:
            strange = (task for task in self._waiting if not self._own_domains(task))
            self._drop(next(strange, self._waiting[0]))
        self._open_waiting()

    def _why_not(self, message: TaskMessage) -> SlapError | None:
        """What is wrong with a task, as far as it can be seen at once: else it would wait."""
        if message.domain not in self._names:
            return UnknownDomainError(f"a task of {message.domain!r}, a domain that is not known")
        if self.current is None or self._choice not in self._own_domains(message):
            return None
        try:
            decode_state(message.initial_state, self.current.domain.types_by_name)
        except SlapError as error:
            return error
        return None

    def _refuse_task(self, error: SlapError) -> None:
        self._refuse("refused_tasks", error)

    # -- opening: one task at a time, the newest first ---------------------------------------------

    def _open_waiting(self) -> None:
        if not self._opening and (self._next() or self._ahead()):
            self._opening = True
            self._node.executor.create_task(self._open_all())

    async def _open_all(self) -> None:
        try:
            while True:
                if (found := self._next()) is not None:
                    await self._open(*found)
                elif (announced := self._ahead()) is not None:
                    await self._prepare_for(announced)
                else:
                    break
        finally:
            self._opening = False

    def _next(self) -> tuple[TaskMessage, DomainChoice] | None:
        """The newest task that waits and whose domain may be usable, and that domain.

        Tasks for which a domain was announced go first: strangers' may wait in any number.
        """
        newest = reversed(self._waiting)
        for message in sorted(newest, key=lambda task: not self._own_domains(task)):
            stamp = stamp_ns(message.header)
            for choice in self._announced.candidates(message.domain, stamp):
                if choice not in self._unusable:
                    return message, choice
        return None

    def _ahead(self) -> DomainChoice | None:
        """The domain to import before there is a task: the newest, until there was a first task."""
        newest = self._announced.newest
        if self.current is not None or newest in self._domains or newest in self._unusable:
            return None
        return newest

    async def _prepare_for(self, choice: DomainChoice) -> Domain | None:
        """Import a domain; None where it is refused."""
        try:
            return await self._domain(choice)
        except Exception as raised:  # of a domain's code
            self._set_aside(choice)
            self._refuse("refused_domains", error_to_answer(self._node, raised))
            return None

    async def _open(self, message: TaskMessage, choice: DomainChoice) -> None:
        domain = await self._prepare_for(choice)
        if domain is None:
            return
        try:
            episode, prepared = await run_in_executor(
                self._workers, lambda: self._made(message, choice, domain)
            )
        except Exception as raised:  # of a domain's code
            self._drop(message)
            self._refuse_task(domain_error(self._node, domain.name, raised))
            return
        self._drop(message, older=True)
        self._choice, self.current, self.opened = choice, episode, message
        if message is self._task:
            self.refusal = None
        self._simulator = frozenset(self._publishers())
        self._on_episode(episode, prepared)
        self._correct()

    def _set_aside(self, choice: DomainChoice) -> None:
        if len(self._unusable) >= UNUSABLE:
            self._unusable.clear()
        self._unusable.add(choice)

    def _drop(self, message: TaskMessage, older: bool = False) -> None:
        """Let a task wait no longer.

        Args:
            message: The task. Newer ones may have taken its room meanwhile.
            older: Whether those that came before it are dropped as well.
        """
        place = next((i for i, task in enumerate(self._waiting) if task is message), -1)
        before = [] if older else self._waiting[: max(place, 0)]
        self._waiting = [*before, *self._waiting[place + 1 :]]

    async def _domain(self, announced: DomainChoice) -> Domain:
        """The domain that was announced, opened once.

        Raises:
            SlapError: It cannot be opened here, or this node was given other skills.
        """
        if announced not in self._domains:
            choices = self._choices(announced)
            opened = await run_in_executor(self._workers, lambda: _opened(choices))
            self._domains[announced] = opened
        self._domains.move_to_end(announced)
        while len(self._domains) > OPENED:
            self._domains.pop(next(choice for choice in self._domains if choice != self._choice))
        return self._domains[announced].domain

    def _choices(self, announced: DomainChoice) -> list[DomainChoice]:
        """Ways to open a domain: with the libraries that were announced, then as this node is told.

        Raises:
            SkillsChangedError: This node was given other skills.
            InvalidParameterError: Skills that are not known here.
        """
        folders = self._libraries.folders(announced.name, announced.digest)
        found = [replace(announced, skills=str(folder)) for folder in folders if announced.digest]
        try:
            return [*found, announced.with_skills_of(self._node.get_name(), self._skills)]
        except SkillsChangedError:
            if not found:
                raise
            return found

    def _made(
        self, message: TaskMessage, announced: DomainChoice, domain: Domain
    ) -> tuple[Episode, T]:
        initial = decode_state(message.initial_state, domain.types_by_name)
        space = domain.atom_space(initial)
        task = Task(initial, decode_goal(message.goal, space), message.step_limit)
        grown = self._libraries.shortcuts(announced.name, announced.digest)
        stamp = stamp_ns(message.header)
        episode = Episode(message.episode, stamp, domain, task, space, grown)
        return episode, self._prepare(episode)

    def _refuse(self, kind: str, error: SlapError) -> None:
        self._refusals.add(kind, error)
        self.refusal = error

    # A simulator that was started again with another domain looks like a second one until DDS has
    # missed the first.

    def _rivalry(self, message: TaskMessage) -> str | None:
        """Why a task is another simulator's; None where it is not, as far as can be told."""
        current = self.current
        if current is None or message.domain == current.domain.name:
            return None
        publishers = self._publishers_lately()
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

    def _publishers_lately(self) -> dict[Endpoint, str]:
        """The same as they were a moment ago, for what strangers may ask many times a second."""
        if monotonic() - self._looked_s > LOOK_PERIOD:
            self._seen, self._looked_s = self._publishers(), monotonic()
        return self._seen

    def _publishers(self) -> dict[Endpoint, str]:
        """Names of the nodes that publish tasks, by their endpoints."""
        topic = self._node.resolve_topic_name(TASK.name)
        return {
            tuple(info.endpoint_gid): f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in self._node.get_publishers_info_by_topic(topic)
        }


def _opened(choices: list[DomainChoice]) -> OpenedDomain:
    """A domain by the first way that has the library that was announced.

    Raises:
        SlapError: None has; the error is that of the last.
    """
    for choice in choices[:-1]:
        with suppress(SkillsChangedError, InvalidLibraryError):
            return OpenedDomain(choice, open_domain(choice))
    return OpenedDomain(choices[-1], open_domain(choices[-1]))
