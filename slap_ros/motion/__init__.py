# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion of the arm: inverse kinematics, collision-free paths and their timing.

Distances between configurations are control steps, budgets are counts, and nothing is drawn but
from a seed. Needs numpy alone.

A motion to a pose is planned like this::

    free = CollisionChecker(obstacles, held=block)
    goal = inverse_kinematics(pose, q, free=free)
    path = plan_path(q, goal, free, seed=0)
    positions = retime(path, free=free)  # one row a control step
"""

from slap_ros.motion.cache import PlanCache
from slap_ros.motion.collision import CollisionChecker
from slap_ros.motion.errors import MotionPlanningError
from slap_ros.motion.inverse_kinematics import (
    ik_candidates,
    ik_solutions,
    inverse_kinematics,
    nearest_configurations,
)
from slap_ros.motion.joints import (
    Free,
    Joints,
    Path,
    control_steps,
    path_configurations,
    path_steps,
    within_limits,
)
from slap_ros.motion.linear import linear_motion, shifted
from slap_ros.motion.planning import plan_path
from slap_ros.motion.retiming import retime, retime_fixed_steps

__all__ = [
    "CollisionChecker",
    "Free",
    "Joints",
    "MotionPlanningError",
    "Path",
    "PlanCache",
    "control_steps",
    "ik_candidates",
    "ik_solutions",
    "inverse_kinematics",
    "linear_motion",
    "nearest_configurations",
    "path_configurations",
    "path_steps",
    "plan_path",
    "retime",
    "retime_fixed_steps",
    "shifted",
    "within_limits",
]
