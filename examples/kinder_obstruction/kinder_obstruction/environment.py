# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""KinDER's DynObstruction2D with one obstruction, unchanged. Lengths in m."""

from __future__ import annotations

import warnings

from kinder.envs.dynamic2d.base_env import PymunkNondeterminismWarning
from kinder.envs.dynamic2d.dyn_obstruction2d import (
    DynObstruction2DEnvConfig,
    ObjectCentricDynObstruction2DEnv,
)

from slap_ros.core import GripperAxis
from slap_ros.core.kinder_world import KinderBridge
from slap_ros.relational import Feature

# The hand opens to 0.26 m between its fingers; KinDER's own default is up to 0.48 m.
WIDTHS = (0.16, 0.24)
CONFIG = DynObstruction2DEnvConfig(
    target_block_width_bounds=WIDTHS, obstruction_width_bounds=WIDTHS
)
PERIOD = 1.0 / CONFIG.control_hz  # s, a step by KinDER's own count

# That resets from a given state do not repeat what ran on is the reason for RebuildEachStep.
warnings.filterwarnings("ignore", category=PymunkNondeterminismWarning)


def make_environment() -> ObjectCentricDynObstruction2DEnv:
    """One environment; nothing is shared with others."""
    return ObjectCentricDynObstruction2DEnv(num_obstructions=1, config=CONFIG)


BRIDGE = KinderBridge(make_environment, subtypes={"obstruction": "obstruction"})
ACTIONS = BRIDGE.action_space(
    (
        *(Feature(axis, "m") for axis in ("x", "y")),
        Feature("turn", "rad"),
        *(Feature(axis, "m") for axis in ("arm", "gripper")),
    ),
    GripperAxis("gripper", closes=CONFIG.min_dgripper, opens=CONFIG.max_dgripper),
)
