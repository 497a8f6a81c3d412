# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap run``. It imports ROS when it runs: help and refusals work without it."""

from __future__ import annotations

from ensemble.cli.run_options import RunOptions


def run(options: RunOptions) -> int:
    """Run all nodes on one task: simulator, perception, planner, skills, recorder."""
    from ensemble.cli.run_task import run_task

    return run_task(options)
