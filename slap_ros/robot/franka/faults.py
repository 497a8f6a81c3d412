# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What franky raises, and what the robot's state says, as errors with codes of ours."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from slap_ros.errors import (
    ControllerAbortedError,
    GripperFailedError,
    InvalidParameterError,
    RobotReflexError,
    RobotUnreachableError,
    RobotVersionError,
    SlapError,
)

RECOVER = "look at the arm, then call the service franka_driver/recover"
# What libfranka's exceptions mean, by the names of their classes in franky.
CAUSES: dict[str, type[SlapError]] = {
    "ControlException": RobotReflexError,
    "NetworkException": RobotUnreachableError,
    "ProtocolException": RobotUnreachableError,
    "IncompatibleVersionException": RobotVersionError,
    "RealtimeException": InvalidParameterError,
}


def robot_fault(error: Exception) -> SlapError:
    """The error that an exception of franky stands for.

    Args:
        error: Exception of a motion, of reading the state, or of connecting.
    """
    cause = CAUSES.get(type(error).__name__, ControllerAbortedError)
    return cause(f"{told(error)}: {_advice(cause)}")


@contextmanager
def translated() -> Iterator[None]:
    """Raise what franky raises as errors of ours.

    Raises:
        SlapError: See :func:`robot_fault`.
    """
    try:
        yield
    except SlapError:
        raise
    except Exception as error:
        raise robot_fault(error) from error


def gripper_fault(error: Exception) -> SlapError:
    """The error that an exception of franky's gripper stands for."""
    if CAUSES.get(type(error).__name__) is RobotUnreachableError:
        return robot_fault(error)
    return GripperFailedError(f"{told(error)}: look at the fingers; a gripper needs homing first")


def reflex(errors: str) -> RobotReflexError:
    """The error of a robot that stands still after a reflex.

    Args:
        errors: Names of the robot's own errors.
    """
    return RobotReflexError(f"{errors or 'the robot is stopped'}: {RECOVER}")


def error_names(errors: Any) -> str:
    """Names of the errors that are set in a ``franky.Errors``, as a list."""
    names = (name for name in dir(errors) if not name.startswith("_"))
    return ", ".join(name for name in names if getattr(errors, name) is True)


def told(error: Exception) -> str:
    """What an exception of libfranka says, in one line and without its prefix."""
    return re.sub(r"\s+", " ", str(error)).removeprefix("libfranka: ").strip(" .!:")


def _advice(cause: type[SlapError]) -> str:
    if cause is RobotVersionError:
        return "install the franky-control that was built for the robot's system version"
    if cause is InvalidParameterError:
        return "start a real-time kernel, or set realtime=false"
    if cause is RobotUnreachableError:
        return "is the robot on, is FCI activated, and is it the only program that drives it?"
    return RECOVER
