# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every node's ``main`` does: start, stop and exit codes."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ensemble.network import start_node
from ensemble.startup import leave_quietly
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.signals import forget_interrupt


def run_node(name: str, make: Callable[[], Node]) -> int:
    """Make a node and spin it until SIGINT, SIGTERM or an error.

    Returns:
        Exit code: 0 after a signal, else the error's code, whose message went to stderr.
    """
    try:
        return _run(name, make)
    finally:
        rclpy.try_shutdown()


def _run(name: str, make: Callable[[], Node]) -> int:
    try:
        if signal.getsignal(signal.SIGINT) is leave_quietly:
            signal.signal(signal.SIGINT, signal.default_int_handler)  # for rclpy to go on with
        _spin(make)
    except (KeyboardInterrupt, ExternalShutdownException):
        forget_interrupt()
        return 0
    except SlapError as error:
        return _refuse(name, error, error.code)
    except ParameterException as error:
        return _refuse(name, error, ErrorCode.INVALID_PARAMETER)
    except Exception:
        # A signal shuts the context down in the middle of whatever callback runs, which then
        # cannot publish any more. That is no failure; anything else is.
        if rclpy.ok():
            raise
    return 0


def _spin(make: Callable[[], Node]) -> None:
    node = start_node(make)
    try:
        if rclpy.ok():  # not stopped while the node was made: rclpy's executor would print an error
            rclpy.spin(node)
    finally:
        node.destroy_node()


def _refuse(name: str, error: Exception, code: ErrorCode) -> int:
    sys.stderr.write(f"{name}: {error}\n")
    return int(code)
