# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rclpy's API over CycloneDDS, where there is no ROS 2.

Imported as ``rclpy``, and only where no real rclpy is: see :mod:`embedded_ros.finder`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if __name__ != "rclpy" and not TYPE_CHECKING:
    raise ImportError("import it as 'rclpy', so that a real rclpy wins where there is one")

from . import logging
from .context import Context
from .executors import Executor, SingleThreadedExecutor
from .parameter import Parameter
from .signals import (
    SignalHandlerOptions,
    install_signal_handlers,
    uninstall_signal_handlers,
)
from .task import Future
from .utilities import get_default_context, get_rmw_implementation_identifier, ok

if TYPE_CHECKING:
    from .node import Node

__all__ = [
    "Context",
    "Future",
    "Parameter",
    "SignalHandlerOptions",
    "create_node",
    "get_default_context",
    "get_global_executor",
    "get_rmw_implementation_identifier",
    "init",
    "logging",
    "ok",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
]

_global_executor: Executor | None = None


def init(
    args: Sequence[str] | None = None,
    *,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> None:
    """Start communication.

    Args:
        args: The command line, ``sys.argv`` by default.
        context: The context to start; the default one where not given.
        domain_id: The DDS domain, ``ROS_DOMAIN_ID`` by default.
        signal_handler_options: Which signals shut down: all with the default context, none
            with another, where not given.

    Raises:
        RuntimeError: The context is started already.
        UnknownROSArgsError: There are ROS arguments that ROS 2 does not have.
    """
    if signal_handler_options is None:
        signal_handler_options = (
            SignalHandlerOptions.ALL if context is None else SignalHandlerOptions.NO
        )
    (context or get_default_context()).init(args, domain_id=domain_id)
    install_signal_handlers(signal_handler_options)


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """End communication.

    Args:
        context: The context to shut down; the default one where not given.
        uninstall_handlers: Whether signals go where they went before; with the default
            context where not given.

    Raises:
        RuntimeError: The context is not started, or shut down already.
    """
    _end_global_executor(context)
    try:
        (context or get_default_context()).shutdown()
    finally:
        if uninstall_handlers or (uninstall_handlers is None and context is None):
            uninstall_signal_handlers()


def try_shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """End communication, where not done yet; arguments as for :func:`shutdown`."""
    _end_global_executor(context)
    (context or get_default_context()).try_shutdown()
    if uninstall_handlers or (uninstall_handlers is None and context is None):
        uninstall_signal_handlers()


def create_node(node_name: str, **kwargs: Any) -> Node:
    """Create a node; arguments as for :class:`rclpy.node.Node`."""
    from .node import Node

    return Node(node_name, **kwargs)


def get_global_executor() -> Executor:
    """The executor that the functions here use where they are given none."""
    global _global_executor
    if _global_executor is None or _global_executor.is_shutdown:
        _global_executor = SingleThreadedExecutor()
    return _global_executor


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run a node's callbacks until shutdown.

    Raises:
        ExternalShutdownException: The context was shut down, by a signal or another thread.
        Exception: Whatever a callback raised.
    """
    executor = executor or get_global_executor()
    try:
        executor.add_node(node)
        executor.spin()
    finally:
        executor.remove_node(node)


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run one of a node's callbacks.

    Raises:
        ExternalShutdownException: The context is shut down.
        Exception: Whatever the callback raised.
    """
    executor = executor or get_global_executor()
    try:
        executor.add_node(node)
        executor.spin_once(timeout_sec)
    finally:
        executor.remove_node(node)


def spin_until_future_complete(
    node: Node,
    future: Future[Any],
    executor: Executor | None = None,
    timeout_sec: float | None = None,
) -> None:
    """Run a node's callbacks until a future is done, or the time is up.

    Raises:
        ExternalShutdownException: The context was shut down.
        Exception: Whatever a callback raised.
    """
    executor = executor or get_global_executor()
    try:
        executor.add_node(node)
        executor.spin_until_future_complete(future, timeout_sec)
    finally:
        executor.remove_node(node)


def _end_global_executor(context: Context | None) -> None:
    global _global_executor
    executor = _global_executor
    if executor is not None and executor.context is (context or get_default_context()):
        executor.shutdown()
        _global_executor = None


def __getattr__(name: str) -> Any:
    raise AttributeError(
        f"module 'rclpy' has no attribute {name!r}: it is not part of embedded_ros; "
        "source a ROS 2 to use it"
    )
