# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording played from start to end: node, mock robot if wanted, executor."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass

from ensemble.hosts import ProcessHost
from ensemble.run import CANCEL_TIMEOUT, DISCOVERY
from ensemble.spinning import Spinner, spinning
from robot_bridge.player import Parameters, Player
from slap_ros.errors import AlreadyRunningError, InvalidParameterError
from slap_ros.relational import State
from slap_ros.robot.rehearsal import Recorded, Rehearsal

BRIDGE = "robot_bridge"


@dataclass(frozen=True)
class Played:
    """What came of a replay that got to its end."""

    steps: int
    final: State | None  # as measured; None where the recording ends with something in the hand

    def reached(self, recorded: Recorded) -> bool | None:
        """Whether the task's goal holds; None where nobody looked."""
        if self.final is None:
            return None
        space = recorded.domain.atom_space(recorded.states[0])
        return space.abstract(self.final) & recorded.goal == recorded.goal


def play(
    recorded: Recorded,
    rehearsal: Rehearsal,
    settings: Parameters,
    mock: Mapping[str, str | int | float] | None,
    on_step: Callable[[int], None],
) -> Played:
    """Execute a recording on a robot.

    Args:
        recorded: What to execute.
        rehearsal: Of it, for this robot.
        settings: Of the robot.
        mock: Parameters of a mock robot to start; None where there is a real one.
        on_step: Called with the number of steps done.

    Raises:
        UnsafeCommandError: It must not be executed.
        AlreadyRunningError: A robot_bridge commands the same robot.
        StartMismatchError: The robot, or an object, is not where the recording begins.
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
        SlapError: A controller or a sensor failed; the robot holds.
        KeyboardInterrupt: After the motion under way was canceled.
    """
    with (
        spinning(lambda: Player(recorded, rehearsal, settings)) as (player, spinner),
        ExitStack() as stack,
    ):
        if spinner.until(lambda: BRIDGE in player.get_node_names(), DISCOVERY):
            raise AlreadyRunningError("a robot_bridge commands this robot: stop it first")
        if mock is not None:
            host = stack.enter_context(ProcessHost({"robot_bridge.mock": _cell(recorded) | mock}))
            spinner.check = host.check
        _drive(player, spinner, on_step)
    if player.failure is not None:
        raise player.failure
    return Played(player.done, player.final)


def _drive(
    player: Player,
    spinner: Spinner,
    on_step: Callable[[int], None],
) -> None:
    played = spinner.executor.create_task(player.play())

    def over() -> bool:
        on_step(player.done)
        return bool(played.done())

    try:
        spinner.until(over, math.inf)
    except KeyboardInterrupt:
        player.hold()
        spinner.until(played.done, CANCEL_TIMEOUT)
        raise


def _cell(recorded: Recorded) -> dict[str, str | int | float]:
    """The mock robot's cell, as the recording begins.

    Raises:
        InvalidParameterError: That task was not sampled, so the mock robot cannot have it.
    """
    if recorded.seed < 0:
        raise InvalidParameterError("a mock robot has sampled tasks only, and this one was not")
    domain = recorded.domain
    return {
        "domain": domain.name,
        "preset": domain.preset,
        "seed": recorded.seed,
        "index": recorded.index,
    }
