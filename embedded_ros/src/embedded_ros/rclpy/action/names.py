# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services and topics that carry an action."""

from __future__ import annotations


def send_goal(action: str) -> str:
    """The service that takes goals."""
    return f"{action}/_action/send_goal"


def get_result(action: str) -> str:
    """The service that hands out results."""
    return f"{action}/_action/get_result"


def cancel_goal(action: str) -> str:
    """The service that cancels goals."""
    return f"{action}/_action/cancel_goal"


def feedback(action: str) -> str:
    """The topic of feedback."""
    return f"{action}/_action/feedback"


def status(action: str) -> str:
    """The topic of the goals' states."""
    return f"{action}/_action/status"
