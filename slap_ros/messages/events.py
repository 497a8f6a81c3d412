# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kinds of events, as slap_msgs numbers them."""

from __future__ import annotations

from enum import IntEnum


class PlanEventKind(IntEnum):
    """What happens to a plan: ``slap_msgs/PlanEvent.kind``."""

    PLANNING_STARTED = 0
    PLANNED = 1
    EDGE_STARTED = 2
    EDGE_REACHED = 3
    DIVERGED = 4
    SOLVED = 5
    FAILED = 6
    IMPROVED = 7


ANNOUNCING = (PlanEventKind.PLANNED, PlanEventKind.IMPROVED)  # a plan, each


class SkillEventKind(IntEnum):
    """What happens to an option under execution: ``slap_msgs/SkillEvent.kind``."""

    STARTED = 0
    REACHED = 1
    FAILED = 2
    CANCELED = 3


class AcquisitionEventKind(IntEnum):
    """What happens to a proposal, its skills and shortcuts: ``slap_msgs/AcquisitionEvent.kind``."""

    STARTED = 0
    ANSWERED = 1
    VERIFIED = 2
    FINISHED = 3
    FAILED = 4
    CANCELED = 5
    ROLLED_OUT = 6
    JUDGED = 7
    ACQUIRED = 8
    VALIDATED = 9
