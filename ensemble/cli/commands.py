# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that bring nodes up. They import ROS when they run: all others work without it."""

from __future__ import annotations

from ensemble.cli.replay_options import WORLD, ReplayOptions
from ensemble.cli.run_options import RunOptions
from slap_ros.cli.bag import replay_in_world


def run(options: RunOptions) -> int:
    """Run all nodes on one task: simulator, perception, planner, skills, recorder."""
    from ensemble.cli.run_task import run_task

    return run_task(options)


def replay(options: ReplayOptions) -> int:
    """Repeat the recorded commands in a new world and compare every state, bit for bit.

    With --to robot, execute the recorded motion on a robot, open loop; try --dry-run first.
    """
    if options.to == WORLD:
        return replay_in_world(options.bag, options.json)
    from ensemble.cli.robot_replay import replay_on_robot

    return replay_on_robot(options)
