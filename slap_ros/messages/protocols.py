# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fields of slap_msgs messages, whether rclpy, rosbags or a test made them.

Fields have the names, units and meaning that the ``.msg`` files give. Only what the core reads
is listed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class Time(Protocol):
    """Fields of ``builtin_interfaces/Time``."""

    sec: int
    nanosec: int


class Header(Protocol):
    """Fields of ``std_msgs/Header``."""

    stamp: Time


class GroundAtomMessage(Protocol):
    """Fields of ``slap_msgs/GroundAtom``."""

    predicate: str
    objects: Sequence[str]


class ObjectStateMessage(Protocol):
    """Fields of ``slap_msgs/ObjectState``."""

    name: str
    type: str
    features: Sequence[float]


class StateMessage(Protocol):
    """Fields of ``slap_msgs/ObjectCentricState``."""

    header: Header
    episode: int
    step: int
    objects: Sequence[ObjectStateMessage]


class AtomsMessage(Protocol):
    """Fields of ``slap_msgs/AbstractState``."""

    header: Header
    episode: int
    step: int
    atoms: Sequence[GroundAtomMessage]
    exact: bool
    seen: Sequence[ObjectStateMessage]
    missing: Sequence[str]


class EpisodeFaultMessage(Protocol):
    """Fields of ``slap_msgs/EpisodeFault``."""

    header: Header
    episode: int
    step: int
    error_code: int
    error_msg: str


class CommandMessage(Protocol):
    """Fields of ``slap_msgs/RobotCommand``."""

    header: Header
    episode: int
    step: int
    deltas: Sequence[float]
    gripper: float


class TypeInfoMessage(Protocol):
    """Fields of ``slap_msgs/TypeInfo``."""

    name: str
    parent: str
    feature_names: Sequence[str]
    feature_units: Sequence[str]


class KeyValueMessage(Protocol):
    """Fields of ``diagnostic_msgs/KeyValue``."""

    key: str
    value: str


class DomainInfoMessage(Protocol):
    """Fields of ``slap_msgs/DomainInfo``."""

    header: Header
    name: str
    preset: str
    types: Sequence[TypeInfoMessage]
    action_names: Sequence[str]
    control_period: float
    configuration: Sequence[KeyValueMessage]
    versions: Sequence[KeyValueMessage]


class TaskMessage(Protocol):
    """Fields of ``slap_msgs/Task``."""

    header: Header
    episode: int
    domain: str
    seed: int
    index: int
    initial_state: StateMessage
    goal: Sequence[GroundAtomMessage]
    step_limit: int


class PlanEdgeMessage(Protocol):
    """Fields of ``slap_msgs/PlanEdge``."""

    kind: int
    name: str
    objects: Sequence[str]
    expected_atoms: Sequence[GroundAtomMessage]
    others_may_appear: bool
    forbidden_atoms: Sequence[GroundAtomMessage]
    predicted_steps: int


class PlanMessage(Protocol):
    """Fields of ``slap_msgs/Plan``."""

    header: Header
    episode: int
    number: int
    goal: Sequence[GroundAtomMessage]
    edges: Sequence[PlanEdgeMessage]
    predicted_steps: int
    bound: float  # not in bags that were recorded before there was such a field
    planner: str
    library: str
    samples: int


class PlanEventMessage(Protocol):
    """Fields of ``slap_msgs/PlanEvent``."""

    header: Header
    episode: int
    step: int
    kind: int
    plan_number: int
    edge: int
    edges_rolled_out: int
    error_code: int
    error_msg: str


class SkillEventMessage(Protocol):
    """Fields of ``slap_msgs/SkillEvent``."""

    header: Header
    episode: int
    step: int
    kind: int
    skill: str
    objects: Sequence[str]


class AcquisitionEventMessage(Protocol):
    """Fields of ``slap_msgs/AcquisitionEvent``."""

    header: Header
    episode: int
    kind: int
    subject: str
    complaints: Sequence[str]
    plan: Sequence[str]
    answer: str
    tokens: int
    seconds: float
    error_msg: str


class LearningEventMessage(AcquisitionEventMessage, Protocol):
    """Fields that events of skills have besides; bags of proposals alone may lack them."""

    operators: Sequence[str]
    iteration: int
    task: int
    progress: float
    success: Sequence[float]
    segment_steps: int
    digest: str


class ShortcutEventMessage(AcquisitionEventMessage, Protocol):
    """Fields that events of shortcuts have besides; earlier bags have no such events."""

    lengths: Sequence[float]
    kept: bool


class PointMessage(Protocol):
    """``geometry_msgs/Point`` or ``geometry_msgs/Vector3``."""

    x: float
    y: float
    z: float


class QuaternionMessage(PointMessage, Protocol):
    """Fields of ``geometry_msgs/Quaternion``."""

    w: float


class PoseMessage(Protocol):
    """Fields of ``geometry_msgs/Pose``."""

    position: PointMessage
    orientation: QuaternionMessage


class ColourMessage(Protocol):
    """Fields of ``std_msgs/ColorRGBA``."""

    r: float
    g: float
    b: float
    a: float


class MarkerMessage(Protocol):
    """Fields of ``visualization_msgs/Marker``."""

    header: Header
    ns: str
    type: int
    pose: PoseMessage
    scale: PointMessage
    color: ColourMessage
    points: Sequence[PointMessage]
    text: str


class MarkersMessage(Protocol):
    """Fields of ``visualization_msgs/MarkerArray``."""

    markers: Sequence[MarkerMessage]
