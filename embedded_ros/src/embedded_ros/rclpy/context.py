# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The context: what ``init`` starts and ``shutdown`` ends."""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any

from embedded_ros.transport.config import (
    checked_domain_id,
    configuration,
    domain_id_from_environment,
)
from embedded_ros.transport.participant import Participant

from ._arguments import RosArguments, parse_arguments
from .exceptions import NotInitializedException

if TYPE_CHECKING:
    from .node import Node

# Contexts that a signal shuts down.
_live_contexts: weakref.WeakSet[Context] = weakref.WeakSet()


class Context:
    """Holds the arguments and the DDS participant that nodes share."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._initialized = False
        self._valid = False
        self._arguments = RosArguments()
        self._domain_id = 0
        self._participant: Participant | None = None
        self._callbacks: list[Callable[[], Any]] = []
        self._nodes: weakref.WeakSet[Node] = weakref.WeakSet()
        self.shut_down_by_signal = False

    def init(
        self,
        args: Sequence[str] | None = None,
        *,
        initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None:
        """Start the context.

        Args:
            args: The command line, ``sys.argv`` by default.
            initialize_logging: Whether ``--log-level`` is applied.
            domain_id: The DDS domain, ``ROS_DOMAIN_ID`` by default.

        Raises:
            RuntimeError: It was started before and not shut down.
            UnknownROSArgsError: There are ROS arguments that ROS 2 does not have.
        """
        with self._lock:
            if self._valid:
                raise RuntimeError("Context.init() must only be called once")
            arguments = parse_arguments(sys.argv if args is None else args)
            self._domain_id = (
                domain_id_from_environment() if domain_id is None else checked_domain_id(domain_id)
            )
            configuration()  # what is wrong in the environment is refused now, not by a node
            self._close()
            self._arguments = arguments
            self._initialized = self._valid = True
            self.shut_down_by_signal = False
            _live_contexts.add(self)
        if initialize_logging:
            from . import logging

            logging.apply_levels(arguments.log_levels)

    def ok(self) -> bool:
        """Whether it is started and not shut down."""
        return self._valid

    def get_domain_id(self) -> int:
        """The DDS domain; raises NotInitializedException before init."""
        if not self._initialized:
            raise NotInitializedException
        return self._domain_id

    @property
    def arguments(self) -> RosArguments:
        """The ROS arguments given to init."""
        return self._arguments

    @property
    def participant(self) -> Participant:
        """The DDS participant, created when first needed.

        Raises:
            NotInitializedException: The context is not started, or shut down.
        """
        participant = self._participant
        if participant is not None and not participant.closed:
            return participant
        with self._lock:
            if not self._valid:
                raise NotInitializedException
            if self._participant is None:
                self._participant = Participant(self._domain_id)
            return self._participant

    def track(self, node: Node) -> None:
        """Remember a node, to destroy it with the context."""
        self._nodes.add(node)

    def on_shutdown(self, callback: Callable[[], Any]) -> None:
        """Call this when the context is shut down; it must be callable.

        Bound methods are kept alive by it until then.
        """
        if not callable(callback):
            raise TypeError("callback should be a callable")
        with self._lock:
            self._callbacks.append(callback)

    def remove_on_shutdown(self, callback: Callable[[], Any]) -> None:
        """Call it no more."""
        with self._lock:
            if callback in self._callbacks:
                self._callbacks.remove(callback)

    def shutdown(self) -> None:
        """Shut down: every wait ends and every DDS entity is deleted.

        Raises:
            RuntimeError: It is not started, or already shut down.
        """
        was_valid = self._valid
        self.try_shutdown()
        if not was_valid:
            raise RuntimeError("Context must be initialized before it can be shutdown")

    def try_shutdown(self) -> None:
        """Shut down, where not done yet."""
        self.invalidate()
        with self._lock:
            self._close()

    def invalidate(self) -> None:
        """The first half of shutdown, all that a signal handler may do: say so, and wake up."""
        with self._lock:
            if not self._valid:
                return
            self._valid = False
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback()
        self.wake()

    def wake(self) -> None:
        """End the current waits of this context's executors; they look around and go on."""
        participant = self._participant
        if participant is not None:
            participant.wake_all()

    def _close(self) -> None:
        participant, self._participant = self._participant, None
        if participant is not None:
            for node in list(self._nodes):
                node.detach_from_context()
            participant.close()
        self._nodes.clear()
        _live_contexts.discard(self)

    def __enter__(self) -> Context:
        self.init()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.try_shutdown()


def live_contexts() -> list[Context]:
    """Every context that is started and not closed."""
    return list(_live_contexts)
