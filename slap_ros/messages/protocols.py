# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shapes of slap_msgs messages, whoever made them: rclpy, rosbags or a test.

Fields have the names, units and meaning that the ``.msg`` files give. Only what the core reads
is listed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class Time(Protocol):
    """``builtin_interfaces/Time``."""

    sec: int
    nanosec: int


class Header(Protocol):
    """``std_msgs/Header``."""

    stamp: Time


class GroundAtomMessage(Protocol):
    """``slap_msgs/GroundAtom``."""

    predicate: str
    objects: Sequence[str]


class ObjectStateMessage(Protocol):
    """``slap_msgs/ObjectState``."""

    name: str
    type: str
    features: Sequence[float]


class StateMessage(Protocol):
    """``slap_msgs/ObjectCentricState``."""

    header: Header
    episode: int
    step: int
    objects: Sequence[ObjectStateMessage]


class AtomsMessage(Protocol):
    """``slap_msgs/AbstractState``."""

    header: Header
    episode: int
    step: int
    atoms: Sequence[GroundAtomMessage]


class CommandMessage(Protocol):
    """``slap_msgs/RobotCommand``."""

    header: Header
    episode: int
    step: int
    deltas: Sequence[float]
    gripper: float


class TypeInfoMessage(Protocol):
    """``slap_msgs/TypeInfo``."""

    name: str
    parent: str
    feature_names: Sequence[str]


class DomainInfoMessage(Protocol):
    """``slap_msgs/DomainInfo``."""

    header: Header
    name: str
    preset: str
    types: Sequence[TypeInfoMessage]


class TaskMessage(Protocol):
    """``slap_msgs/Task``."""

    header: Header
    episode: int
    domain: str
    seed: int
    index: int
    initial_state: StateMessage
    goal: Sequence[GroundAtomMessage]


class PlanEdgeMessage(Protocol):
    """``slap_msgs/PlanEdge``."""

    kind: int
    name: str


class PlanMessage(Protocol):
    """``slap_msgs/Plan``."""

    header: Header
    episode: int
    goal: Sequence[GroundAtomMessage]
    edges: Sequence[PlanEdgeMessage]
    planner: str
    library: str
    samples: int


class PlanEventMessage(Protocol):
    """``slap_msgs/PlanEvent``."""

    header: Header
    episode: int
    step: int
    kind: int
    edges_rolled_out: int
    error_code: int
    error_msg: str


class SkillEventMessage(Protocol):
    """``slap_msgs/SkillEvent``."""

    header: Header
    episode: int
    step: int
    kind: int
    skill: str
    objects: Sequence[str]
