# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that bring nodes up. They import ROS when they run: all others work without it."""

from __future__ import annotations

from ensemble.cli.replay_options import WORLD, ReplayOptions
from ensemble.cli.run_options import RunOptions
from slap_ros.cli.bag import replay_in_world


def run(options: RunOptions) -> int:
    """Run the whole ensemble on one task: simulator, perception, planner, skills, recorder."""
    from ensemble.cli.run_task import run_task

    return run_task(options)


def replay(options: ReplayOptions) -> int:
    """Feed the recorded commands to a fresh world and compare every state, bit for bit.

    Or, with --to robot, execute the recorded motion on a robot, open loop: begin with --dry-run.
    """
    if options.to == WORLD:
        return replay_in_world(options.bag, options.json)
    from ensemble.cli.robot_replay import replay_on_robot

    return replay_on_robot(options)
