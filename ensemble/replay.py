# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording executed on a robot from start to end: node, driver if wanted, executor."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Protocol

from ensemble.launcher import ProcessLauncher
from ensemble.nodes import node_class
from ensemble.robot_parameters import BRIDGES, PlayerParameters
from ensemble.run import CANCEL_TIMEOUT, DISCOVERY
from ensemble.spinner import Spinner, temporary_node
from slap_ros.errors import AlreadyRunningError, InvalidParameterError, SlapError
from slap_ros.relational import State
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.recorded_motion import RecordedMotion

PLAYER = "robot_bridge.player"
MOCK_ROBOT, FRANKA_DRIVER = "robot_bridge.mock", "robot_bridge.franka"


class MotionPlayer(Protocol):
    """A node that executes a recording, as far as this module needs it.

    Attributes:
        failure: Why it ended early, if it did.
        done: Steps executed so far.
        final: The state as measured at the end; None where something is still held then.
    """

    failure: SlapError | None
    done: int
    final: State | None

    async def play(self) -> None:
        """Execute the recording."""
        ...

    def hold(self) -> None:
        """Have the motion under way canceled."""
        ...

    def get_node_names(self) -> list[str]:
        """Names of the nodes on the network."""
        ...


@dataclass(frozen=True)
class RobotDriver:
    """A node that drives a robot, or is one.

    Args:
        name: Name of the module that is run as a process.
        parameters: Parameters of the node.
        simulates: Whether it begins in the state in which the recording does.
    """

    name: str
    parameters: Mapping[str, str | int | float | tuple[float, ...]]
    simulates: bool = True


@dataclass(frozen=True)
class RobotReplayResult:
    """The result of a replay that got to its end.

    Args:
        steps: Number of steps executed.
        final: State measured at the end; None where the recording ends with something in the hand.
    """

    steps: int
    final: State | None

    def reached(self, recorded: RecordedMotion) -> bool | None:
        """Whether the task's goal holds; None where nothing was measured at the end."""
        if self.final is None:
            return None
        space = recorded.domain.atom_space(recorded.states[0])
        return space.abstract(self.final) & recorded.goal == recorded.goal


def replay_on_robot(
    recorded: RecordedMotion,
    dry_run: DryRun,
    parameters: PlayerParameters,
    driver: RobotDriver | None,
    on_step: Callable[[int], None],
) -> RobotReplayResult:
    """Execute a recording on a robot.

    Args:
        recorded: What to execute.
        dry_run: Dry run of ``recorded``, within the limits of this robot.
        parameters: Parameters of the robot.
        driver: Node to start for the robot; None where its own controllers run.
        on_step: Called with the number of steps executed, often.

    Returns:
        What came of it.

    Raises:
        UnsafeCommandError: It must not be executed.
        AlreadyRunningError: A robot_bridge commands the same robot.
        StartMismatchError: The robot, or an object, is not where the recording begins.
        InvalidParameterError: An environment variable, such as ROS_DOMAIN_ID, is wrong.
        SlapError: A controller or a sensor failed; the robot holds.
        KeyboardInterrupt: After the motion under way was canceled.
    """
    with (
        temporary_node(lambda: node_class(PLAYER)(recorded, dry_run, parameters)) as made,
        ExitStack() as stack,
    ):
        player: MotionPlayer = made[0]
        spinner = made[1]
        if spinner.spin_until(lambda: not BRIDGES.isdisjoint(player.get_node_names()), DISCOVERY):
            raise AlreadyRunningError("a robot_bridge commands this robot: stop it first")
        if driver is not None:
            task = _sampled_task(recorded) if driver.simulates else {}
            nodes = {driver.name: task | driver.parameters}
            launcher = stack.enter_context(ProcessLauncher(nodes))
            spinner.check = launcher.check
        _play(player, spinner, on_step)
    if player.failure is not None:
        raise player.failure
    return RobotReplayResult(player.done, player.final)


def _play(player: MotionPlayer, spinner: Spinner, on_step: Callable[[int], None]) -> None:
    played = spinner.executor.create_task(player.play())

    def over() -> bool:
        on_step(player.done)
        return bool(played.done())

    try:
        spinner.spin_until(over, math.inf)
    except KeyboardInterrupt:
        player.hold()
        spinner.spin_until(played.done, CANCEL_TIMEOUT)
        raise


def _sampled_task(recorded: RecordedMotion) -> dict[str, str | int | float | tuple[float, ...]]:
    """The task in whose initial state a simulated robot is to be.

    Raises:
        InvalidParameterError: That task was not sampled, so a simulated robot cannot have it.
    """
    if recorded.seed < 0:
        raise InvalidParameterError(
            "a simulated robot has sampled tasks only, and this one was not"
        )
    return {
        "domain": recorded.domain.name,
        "preset": recorded.domain.preset,
        "seed": recorded.seed,
        "index": recorded.index,
    }
