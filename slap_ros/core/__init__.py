# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The contract between domains and everything that plans, learns, executes or shows."""

from slap_ros.core.acquisition import Acquisition, Approach, Primitives, Script, SideApproach, Sides
from slap_ros.core.action_space import Action, ActionSpace, GripperAxis
from slap_ros.core.display import Animate, Display, PictureSize, VisibleBody
from slap_ros.core.domain import Domain, Execution, Goal
from slap_ros.core.domain_factory import DomainFactory, presets
from slap_ros.core.goals import task_with_goal
from slap_ros.core.learner_interface import LearnerInterface, Learning, SettingValue
from slap_ros.core.skill import (
    DemandingSkill,
    ForeseeingPolicy,
    GradualSkill,
    Policy,
    ProvingSkill,
    Skill,
)
from slap_ros.core.task import UNSAMPLED, Task
from slap_ros.core.world import MakeVectorWorld, SyncVectorWorld, VectorWorld, World

__all__ = [
    "Acquisition",
    "Action",
    "ActionSpace",
    "Animate",
    "PictureSize",
    "Approach",
    "DemandingSkill",
    "Display",
    "Domain",
    "DomainFactory",
    "Execution",
    "ForeseeingPolicy",
    "Goal",
    "GradualSkill",
    "GripperAxis",
    "LearnerInterface",
    "Learning",
    "MakeVectorWorld",
    "Policy",
    "ProvingSkill",
    "Primitives",
    "Script",
    "SettingValue",
    "SideApproach",
    "Sides",
    "Skill",
    "SyncVectorWorld",
    "Task",
    "UNSAMPLED",
    "VectorWorld",
    "VisibleBody",
    "World",
    "presets",
    "task_with_goal",
]
