# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The names of message types, and of what is in them."""

from __future__ import annotations

PACKAGE = "slap_msgs"

DOMAIN_INFO = "slap_msgs/msg/DomainInfo"
TASK = "slap_msgs/msg/Task"
STATE = "slap_msgs/msg/ObjectCentricState"
ATOMS = "slap_msgs/msg/AbstractState"
COMMAND = "slap_msgs/msg/RobotCommand"
FAULT = "slap_msgs/msg/EpisodeFault"
PLAN = "slap_msgs/msg/Plan"
PLAN_EVENT = "slap_msgs/msg/PlanEvent"
SKILL_EVENT = "slap_msgs/msg/SkillEvent"
SKILL_LIBRARY = "slap_msgs/msg/SkillLibrary"
ACQUISITION_EVENT = "slap_msgs/msg/AcquisitionEvent"
MARKERS = "visualization_msgs/msg/MarkerArray"
BODIES = "bodies"  # the namespace of markers that show what is there
ROBOT = "robot"  # that of markers that show the arm
CUBE, TRIANGLE_LIST = 1, 11  # types of markers that are drawn
