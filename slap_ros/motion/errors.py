# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why a motion could not be planned."""

from __future__ import annotations

from slap_ros.errors import SkillNotApplicableError


class MotionPlanningError(SkillNotApplicableError):
    """No collision-free motion was found within the budget, or an end of it collides."""
