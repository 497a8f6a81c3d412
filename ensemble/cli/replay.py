# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag``, with ``replay``, which may also move a robot; it imports ROS only then."""

from __future__ import annotations

from ensemble.cli.replay_options import WORLD, ReplayOptions
from slap_ros.cli.bag import app as bag_app
from slap_ros.cli.bag import replay_in_world
from slap_ros.cli.console import exits
from slap_ros.cli.options import flat_options


@bag_app.command("replay")
@exits
@flat_options
def replay(options: ReplayOptions) -> int:
    """Repeat the recorded commands in a new world and compare every state, bit for bit.

    With --to robot, execute the recorded motion on a robot, open loop; try --dry-run first.
    """
    if options.to == WORLD:
        return replay_in_world(options.bag, options.namespace, options.json)
    from ensemble.cli.robot_replay import replay_on_robot

    return replay_on_robot(options)
