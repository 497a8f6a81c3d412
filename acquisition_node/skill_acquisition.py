# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One goal of ``acquire_skills``."""

from __future__ import annotations

from typing import Any

from slap_msgs.action import AcquireSkills

from acquisition_node.trainer_goal import TrainerGoal


class SkillAcquisition(TrainerGoal):
    """Skills that a goal takes, under way."""

    kind = AcquireSkills
    command = "acquire"
    last = "acquired"
    place = "beside"

    def more(self) -> dict[str, Any]:
        """Nothing: all that was learned are skills."""
        return {}
