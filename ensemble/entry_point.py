# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every node's ``main`` does: start, stop and exit codes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import closing
from traceback import format_exc

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from ensemble.network import start_node
from slap_ros.errors import ErrorCode, SlapError
from slap_ros.redaction import without_secrets
from slap_ros.signals import (
    OneInterrupt,
    forget_interrupt,
    interrupted_once,
    interrupts_in_destructors,
)


def run_node(name: str, make: Callable[[], Node]) -> int:
    """Make a node and spin it until SIGINT, SIGTERM or an error.

    Returns:
        Exit code: 0 after a signal, else the error's code, whose message went to stderr.
    """
    try:
        with interrupted_once() as interrupt, interrupts_in_destructors(interrupt.send_again):
            return _run(name, make, interrupt)
    except KeyboardInterrupt:  # it came while a node ended that rclpy had told to end already
        return 0
    finally:
        rclpy.try_shutdown()


def _run(name: str, make: Callable[[], Node], interrupt: OneInterrupt) -> int:
    try:
        _spin(make, interrupt)
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


def _spin(make: Callable[[], Node], interrupt: OneInterrupt) -> None:
    node = start_node(make)
    try:
        with closing(interrupt):
            if rclpy.ok():  # not stopped while it was made: rclpy's executor would print an error
                rclpy.spin(node)
    finally:
        node.destroy_node()


def _refuse(name: str, error: Exception, code: ErrorCode) -> int:
    sys.stderr.write(f"{name}: {error}\n")
    return int(code)
