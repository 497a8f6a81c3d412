# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every node in the world's place does: one step per command, episodes, refusals.

The simulator and the robot bridge are such nodes. Each decides how a command becomes a state; when
it has one, it publishes it with :meth:`LockstepWorld._publish_step`, and only then is the next
command accepted.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from time import monotonic
from typing import Any, Generic, TypeVar

from builtin_interfaces.msg import Time
from rclpy.node import Node
from slap_msgs.msg import RobotCommand, SkillLibrary
from slap_msgs.srv import ResetTask

from ensemble import encode
from ensemble.announced_libraries import AnnouncedLibraries
from ensemble.answering import domain_error, error_to_answer
from ensemble.diagnostics import DiagnosticsPublisher
from ensemble.endpoints import advertise, subscribe
from ensemble.interfaces import (
    COMMAND,
    DOMAIN,
    FAULT,
    RESET_TASK,
    SKILLS,
    STATE,
    TASK,
    VOLATILE,
)
from ensemble.parameters import read_parameters
from ensemble.world_parameters import WorldParameters
from slap_ros.core import UNSAMPLED, Action, Task
from slap_ros.errors import (
    ErrorCode,
    InvalidCommandError,
    SlapError,
    StaleCommandError,
    UnsafeCommandError,
)
from slap_ros.messages.decode import decode_command, stamp_ns
from slap_ros.relational import State
from slap_ros.skills.domain_choice import open_domain

QUIET = 10.0  # s between two log lines of a kind: whoever sends nonsense may send a lot of it
REFUSALS = {  # what is counted, by the error that refuses a command
    StaleCommandError: "stale_commands",
    InvalidCommandError: "invalid_commands",
    UnsafeCommandError: "unsafe_commands",
}


P = TypeVar("P", bound=WorldParameters)


class LockstepWorld(Node, ABC, Generic[P]):
    """A node that takes one step per command.

    A subclass calls :meth:`_open_episode` when it has a first state, and :meth:`_publish_domain`
    before if that takes its time.
    """

    def __init__(self, name: str, parameters: type[P], counted: tuple[str, ...], **kwargs: Any):
        """Read the parameters and open the topics.

        Args:
            name: The node's.
            parameters: The dataclass of its parameters.
            counted: What its diagnostics count besides steps, refused commands and faults.
            kwargs: The node's.

        Raises:
            UnknownDomainError: There is no such domain.
            InvalidParameterError: The domain has no such preset, or no such skills.
        """
        super().__init__(name, **kwargs)
        self._settings = read_parameters(self, parameters)
        self._domain = open_domain(self._settings.choice)
        self._libraries = AnnouncedLibraries(self._settings.libraries)
        self._offered = False  # whether one is to be taken on with the next episode
        self._warned_s: dict[str, float] = {}  # by kind
        self._episode = 0
        self._step = 0
        self._opened_ns = 0  # the stamp of the episode's task
        self._fault = ErrorCode.NONE  # what ended the episode
        kinds = ("steps", "stale_commands", "invalid_commands", "faults", *counted)
        self._counts: Counter[str] = Counter(dict.fromkeys(kinds, 0))
        self._domains = self.create_publisher(DOMAIN.type, DOMAIN.name, DOMAIN.qos)
        self._tasks = self.create_publisher(TASK.type, TASK.name, TASK.qos)
        self._states = advertise(self, STATE)
        self._faults = self.create_publisher(FAULT.type, FAULT.name, FAULT.qos)
        # Volatile: commands from before this node started answer another world's states.
        self.create_subscription(COMMAND.type, COMMAND.name, self._on_command, VOLATILE)
        subscribe(self, SKILLS, self._on_skills)
        self.create_service(RESET_TASK.type, RESET_TASK.name, self._on_reset)
        DiagnosticsPublisher(self, self._diagnostics)

    # -- what each world does its own way -------------------------------------------------------

    @abstractmethod
    def _apply(self, action: Action) -> None:
        """Begin a step.

        Raises:
            InvalidCommandError: The action is not in the domain's action space.
            UnsafeCommandError: A real arm must not execute it.
        """

    @abstractmethod
    def _reset(self, request: ResetTask.Request) -> None:
        """Open the episode that is asked for.

        Raises:
            SlapError: It cannot be opened; the current one goes on.
        """

    @abstractmethod
    def _occupation(self) -> str:
        """What the world waits for, for messages; empty when that is a command."""

    @abstractmethod
    def _show(self, state: State, stamp: Time) -> None:
        """Publish a state for people to look at."""

    def _diagnostics(self) -> dict[str, object]:
        return {**self._counts, "episode": self._episode, "fault": self._fault.name}

    # -- commands and steps ---------------------------------------------------------------------

    def _on_command(self, message: RobotCommand) -> None:
        with self._refusing():
            self._require_current(message)
            self._apply(decode_command(message, self._domain.action_space))

    @contextmanager
    def _refusing(self) -> Iterator[None]:
        """Refuse and count a command that cannot be executed; what a domain raises is a fault."""
        try:
            yield
        except tuple(REFUSALS) as error:
            self._refuse(error)
        except Exception as raised:  # of a domain's code
            self._fail(domain_error(self, self._domain.name, raised))

    def _require_current(self, message: RobotCommand) -> None:
        """Refuse a command that does not answer the current state, or not as the first one."""
        occupation = self._occupation()
        if occupation or (message.episode, message.step) != (self._episode, self._step):
            raise StaleCommandError(
                f"command for episode {message.episode}, step {message.step} refused: "
                f"the world is at episode {self._episode}, step {self._step}"
                f"{occupation and ', '}{occupation}"
            )

    def _refuse(self, error: SlapError) -> None:
        kind = REFUSALS[type(error)]
        self._counts[kind] += 1
        self._warn(kind, f"{error} ({self._counts[kind]} {kind.replace('_', ' ')})")

    def _fail(self, error: SlapError) -> None:
        """End the episode: no step is taken, and no state published, until the next reset."""
        self._fault = error.code
        self._counts["faults"] += 1
        self._publish_fault(error)
        self.get_logger().error(f"{error.code.name}: {error}; nothing moves until reset_task")

    def _publish_fault(self, error: SlapError) -> None:
        """Say what ended the episode, or, of episode 0, why there is none yet."""
        self._faults.publish(encode.fault(error, self._episode, self._opened_ns, self._step))

    def _publish_step(self, state: State) -> None:
        """Publish the state after a step; from now on a command that answers it is accepted."""
        self._step += 1
        self._counts["steps"] += 1
        now = self._now()
        self._states.publish(encode.state(state, self._episode, self._step, now))
        self._try_to_show(state, now)  # after the state: the other nodes are at work meanwhile

    def _try_to_show(self, state: State, stamp: Time) -> None:
        try:
            self._show(state, stamp)
        except Exception as raised:  # of a domain's code: nobody but people misses the picture
            # Without a context nothing can be published any more, and it is nobody's fault.
            if self.context.ok() and self._is_due("picture"):
                error = domain_error(self, self._domain.name, raised)
                self.get_logger().error(f"not shown: {error}")

    # -- episodes -------------------------------------------------------------------------------

    def _publish_domain(self, stamp: Time | None = None) -> None:
        """Say what runs, also before there is a first state.

        Args:
            stamp: Stamp of the task that is published with it, by which nodes know that it is the
                task's; None: now.
        """
        self._domains.publish(encode.domain_info(self._domain, stamp or self._now()))

    def _open_episode(self, task: Task) -> None:
        """Publish a task and its initial state, as step 0 of a new episode.

        Args:
            task: What is to be solved.
        """
        self._episode += 1
        self._step = 0
        self._fault = ErrorCode.NONE
        now = self._now()
        self._publish_domain(now)  # for whoever was told something else meanwhile
        message = encode.task(task, self._domain, self._episode, now)
        self._opened_ns = stamp_ns(message.header)
        self._tasks.publish(message)
        self._states.publish(message.initial_state)
        self._try_to_show(task.initial_state, now)
        origin = "not sampled" if task.seed == UNSAMPLED else f"seed {task.seed}"
        self.get_logger().info(f"episode {self._episode}: {self._domain.name}, {origin}")

    def _on_reset(
        self, request: ResetTask.Request, response: ResetTask.Response
    ) -> ResetTask.Response:
        try:
            self._take_on_skills()
            self._reset(request)
        except Exception as raised:  # of a domain's code, for a state that it never thought of
            error = error_to_answer(self, raised)
            response.error_code, response.error_msg = int(error.code), str(error)
        else:
            response.error_code = int(ErrorCode.NONE)
        response.episode = self._episode
        return response

    def _on_skills(self, message: SkillLibrary) -> None:
        if message.domain != self._domain.name:
            return
        try:
            self._offered |= self._libraries.add(message)
        except SlapError as error:
            self._warn("library", f"a library of skills is left out: {error}")

    def _take_on_skills(self) -> None:
        """Open the domain with the skills that were acquired meanwhile, if any can be used.

        Of several, those announced last; if none can, the next episode has the skills as they are.
        """
        folders = self._libraries.folders(self._domain.name) if self._offered else []
        self._offered = False
        for folder in folders:
            try:
                self._domain = open_domain(replace(self._settings.choice, skills=str(folder)))
            except SlapError as error:
                self._warn("library", f"a library of skills is left out: {error}")
            else:
                return

    def _warn(self, kind: str, words: str) -> None:
        """Log a warning, unless one of its kind was logged a moment ago."""
        if self._is_due(kind):
            self.get_logger().warning(words)

    def _is_due(self, kind: str) -> bool:
        """Whether nothing of a kind was logged a moment ago; then it counts as logged now."""
        now_s = monotonic()
        due = now_s - self._warned_s.get(kind, -QUIET) >= QUIET
        if due:
            self._warned_s[kind] = now_s
        return due

    def _now(self) -> Time:
        return self.get_clock().now().to_msg()
