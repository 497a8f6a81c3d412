# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names and QoS of every topic, service and action.

Names are relative: ``slap/state`` becomes ``/slap/state``, or ``/robot1/slap/state`` for nodes in
the namespace ``/robot1``. ``tf`` and ``diagnostics`` as well, so that ensembles whose blocks have
the same names can share a network.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from slap_msgs.action import ExecuteSkill, SolveTask
from slap_msgs.msg import (
    AbstractState,
    DomainInfo,
    ObjectCentricState,
    Plan,
    PlanEvent,
    RobotCommand,
    SkillEvent,
    Task,
)
from slap_msgs.srv import ListSkills, ResetTask
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray


def _reliable(depth: int, durability: DurabilityPolicy) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


# The newest one only, also for those who come late.
LATCHED = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)
# An episode's worth, also for those who come late: a recorder or planner that starts after the
# simulator, or starts again, misses nothing.
EPISODE = _reliable(1000, DurabilityPolicy.TRANSIENT_LOCAL)
# From now on: for whoever must not act on the past.
VOLATILE = _reliable(1000, DurabilityPolicy.VOLATILE)
# Whatever a robot's driver offers, reliable or not; what is old is of no use.
SENSOR_DATA = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=100,
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


DOMAIN = Topic("slap/domain", DomainInfo, LATCHED)
TASK = Topic("slap/task", Task, LATCHED)
STATE = Topic("slap/state", ObjectCentricState, EPISODE)
ATOMS = Topic("slap/atoms", AbstractState, EPISODE)
COMMAND = Topic("slap/command", RobotCommand, EPISODE)
PLAN = Topic("slap/plan", Plan, LATCHED)
PLAN_EVENTS = Topic("slap/plan_events", PlanEvent, EPISODE)
SKILL_EVENTS = Topic("slap/skill_events", SkillEvent, EPISODE)
DIAGNOSTICS = Topic("diagnostics", DiagnosticArray, VOLATILE)
MARKERS = Topic("slap/markers", MarkerArray, EPISODE)
TF = Topic("tf", TFMessage, _reliable(100, DurabilityPolicy.VOLATILE))
TF_STATIC = Topic("tf_static", TFMessage, _reliable(100, DurabilityPolicy.TRANSIENT_LOCAL))
JOINT_STATES = Topic("joint_states", JointState, EPISODE)
RECORDED = (
    DOMAIN,
    TASK,
    STATE,
    ATOMS,
    COMMAND,
    PLAN,
    PLAN_EVENTS,
    SKILL_EVENTS,
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
