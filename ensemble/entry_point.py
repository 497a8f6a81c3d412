# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every node's ``main`` does: start, stop and exit codes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from traceback import format_exc

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ensemble.network import start_node
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.redaction import without_secrets
from slap_ros.signals import forget_interrupt, interrupts_ignored, interrupts_in_destructors


def run_node(name: str, make: Callable[[], Node]) -> int:
    """Make a node and spin it until SIGINT, SIGTERM or an error.

    Returns:
        Exit code: 0 after a signal, else the error's code, whose message went to stderr.
    """
    with interrupts_in_destructors(_say_nothing):
        try:
            return _run(name, make)
        finally:
            rclpy.try_shutdown()


def _say_nothing(_: KeyboardInterrupt) -> None:
    """Leave it: rclpy has shut the context down by then, which ends the node as well."""


def _run(name: str, make: Callable[[], Node]) -> int:
    try:
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
            sys.stderr.write(without_secrets(format_exc()))
            return int(ErrorCode.UNKNOWN)
    return 0


def _spin(make: Callable[[], Node]) -> None:
    node = start_node(make)
    try:
        if rclpy.ok():  # not stopped while the node was made: rclpy's executor would print an error
            rclpy.spin(node)
    finally:
        with interrupts_ignored():
            node.destroy_node()


def _refuse(name: str, error: Exception, code: ErrorCode) -> int:
    sys.stderr.write(f"{name}: {error}\n")
    return int(code)
