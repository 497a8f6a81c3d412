# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names and QoS of every topic, service and action.

Names are relative: ``slap/state`` becomes ``/slap/state``, or ``/robot1/slap/state`` for nodes in
the namespace ``/robot1``. ``tf`` and ``diagnostics`` as well, so that ensembles whose blocks have
the same names can share a network.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from slap_msgs.action import (
    AcquireSkills,
    ExecuteSkill,
    GrowSkills,
    ProposeOperators,
    SolveTask,
)
from slap_msgs.msg import (
    AbstractState,
    AcquisitionEvent,
    DomainInfo,
    EpisodeFault,
    ObjectCentricState,
    Plan,
    PlanEvent,
    RobotCommand,
    SkillEvent,
    SkillLibrary,
    Task,
)
from slap_msgs.srv import ListSkills, ResetTask
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from slap_ros.messages import qos
from slap_ros.messages.qos import OfferedQos


@cache
def qos_profile(offered: OfferedQos) -> QoSProfile:
    """The QoS with which something is published; it keeps the last messages, reliably."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=offered.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL
            if offered.transient_local
            else DurabilityPolicy.VOLATILE
        ),
    )


LATCHED = qos_profile(qos.LATCHED)
EPISODE = qos_profile(qos.EPISODE)
VOLATILE = qos_profile(qos.VOLATILE)
# As a robot's driver publishes, reliable or not; old messages are of no use.
SENSOR_DATA = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=100,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)
# Of pictures, which are large: the last one, from a camera that publishes reliably or not.
NEWEST_PICTURE = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.VOLATILE,
)


@dataclass(frozen=True)
class Topic:
    """A topic's name, message type and QoS."""

    name: str
    type: Any
    qos: QoSProfile

    @property
    def type_name(self) -> str:
        """The message type as ROS 2 writes it, e.g. slap_msgs/msg/Task."""
        package, kind = self.type.__module__.split(".")[:2]
        return f"{package}/{kind}/{self.type.__name__}"


def _topic(name: str, message_type: Any) -> Topic:
    """A topic that is offered as the table for publishers and bags says."""
    return Topic(name, message_type, qos_profile(qos.OFFERED[name]))


DOMAIN = _topic("slap/domain", DomainInfo)
TASK = _topic("slap/task", Task)
STATE = _topic("slap/state", ObjectCentricState)
ATOMS = _topic("slap/atoms", AbstractState)
COMMAND = _topic("slap/command", RobotCommand)
FAULT = _topic("slap/fault", EpisodeFault)
PLAN = _topic("slap/plan", Plan)
PLAN_EVENTS = _topic("slap/plan_events", PlanEvent)
SKILL_EVENTS = _topic("slap/skill_events", SkillEvent)
ACQUISITION_EVENTS = _topic("slap/acquisition_events", AcquisitionEvent)
SKILLS = _topic("slap/skills", SkillLibrary)
DIAGNOSTICS = _topic("diagnostics", DiagnosticArray)
MARKERS = _topic("slap/markers", MarkerArray)
TF = _topic("tf", TFMessage)
TF_STATIC = _topic("tf_static", TFMessage)
JOINT_STATES = _topic("joint_states", JointState)
RECORDED = (
    DOMAIN,
    TASK,
    STATE,
    ATOMS,
    COMMAND,
    FAULT,
    PLAN,
    PLAN_EVENTS,
    SKILL_EVENTS,
    ACQUISITION_EVENTS,
    SKILLS,
    MARKERS,
    TF,
    JOINT_STATES,
    DIAGNOSTICS,
)


@dataclass(frozen=True)
class Call:
    """A service's or action's name and type."""

    name: str
    type: Any


RESET_TASK = Call("slap/reset_task", ResetTask)
LIST_SKILLS = Call("slap/list_skills", ListSkills)
CLOSE_BAG = Call("slap/close_bag", Trigger)
SOLVE_TASK = Call("slap/solve_task", SolveTask)
EXECUTE_SKILL = Call("slap/execute_skill", ExecuteSkill)
PROPOSE_OPERATORS = Call("slap/propose_operators", ProposeOperators)
ACQUIRE_SKILLS = Call("slap/acquire_skills", AcquireSkills)
GROW_SKILLS = Call("slap/grow_skills", GrowSkills)
CALLED = (
    RESET_TASK,
    LIST_SKILLS,
    CLOSE_BAG,
    SOLVE_TASK,
    EXECUTE_SKILL,
    PROPOSE_OPERATORS,
    ACQUIRE_SKILLS,
    GROW_SKILLS,
)
