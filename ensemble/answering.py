# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a service or an action is asked, it answers; what a domain raises is named."""

from __future__ import annotations

from traceback import format_exc

from rclpy.node import Node

from slap_ros.errors import InternalError, InvalidDomainError, SlapError, error_from
from slap_ros.redaction import without_secrets


def error_to_answer(node: Node, error: Exception) -> SlapError:
    """The error that goes into an answer. To be called where the error was caught.

    Args:
        node: Node that answers. Its log gets the traceback of an error that is not one of slap_ros,
            for instance of a bug in another distribution's domain.
        error: What was raised.

    Returns:
        The error itself if it is one of slap_ros, or an InternalError.
    """
    if isinstance(error, SlapError):
        return error
    _log_traceback(node)
    return InternalError(
        f"{_named(error)} (where it was raised is in the log of {node.get_name()})"
    )


def domain_error(node: Node, domain: str, error: Exception) -> SlapError:
    """The error that stands for what a domain's code raised. To be called where it was caught.

    Args:
        node: Node whose log gets the traceback of an error that is not one of slap_ros.
        domain: The domain's name.
        error: What was raised.

    Returns:
        An error that names the domain, with the code of an error of slap_ros, if it is one.
    """
    if isinstance(error, SlapError):
        return error_from(error.code, f"domain {domain}: {error}")
    _log_traceback(node)
    return InvalidDomainError(
        f"domain {domain} raised {_named(error)} (the log of {node.get_name()} says where)"
    )


def _named(error: Exception) -> str:
    return without_secrets(f"{type(error).__name__}: {error}")


def _log_traceback(node: Node) -> None:
    """Of what is being handled; not so once the node is shut down: then all that goes on fails."""
    if node.context.ok():
        node.get_logger().error(without_secrets(format_exc()))
