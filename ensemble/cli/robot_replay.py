# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap bag replay --to robot``: a recorded motion checked, then executed open loop."""

from __future__ import annotations

from dataclasses import asdict

from ensemble import replay as ensemble_replay
from ensemble.cli.motion_check import as_data, blended_run, require_yes, show_check, tell_check
from ensemble.cli.replay_options import ReplayOptions
from ensemble.nodes import SLOW_CLOCK
from ensemble.parameters import parse_parameters
from ensemble.replay import RobotDriver
from ensemble.robot_parameters import (
    BEFORE_MUJOCO,
    TOLD_THE_DRIVER,
    FrankaPlayerParameters,
    PlayerParameters,
    parse_mock_robot,
)
from slap_ros.cli.bars import counting_bars
from slap_ros.cli.console import console, print_json, print_result
from slap_ros.errors import ErrorCode, InvalidParameterError
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.franka.installed import require_franky, simulator_python
from slap_ros.robot.recorded_motion import RecordedMotion, read_recorded_motion
from slap_ros.robot.worlds import FRANKA, FRANKA_SIM, MOCK

# Of a simulated FR3: s in which it has imported what it needs; and nothing is around it.
SIMULATED = {"start_timeout": 120.0, "workspace": BEFORE_MUJOCO["workspace"]}
REACHED = {
    None: "nothing was measured at the end",
    True: "the goal holds",
    False: "the goal does not hold",
}


def replay_on_robot(options: ReplayOptions) -> int:
    """Check the motion, and unless that is all, execute it; the exit code.

    Raises:
        TaskCanceledError: The person at the terminal did not let the arm move.
        SlapError: The motion must not be executed, or failed; a robot then holds.
    """
    parameters = _parameters(options)
    recorded = read_recorded_motion(options.bag, options.namespace)
    checked = _checked(recorded, parameters)
    if options.dry_run:
        return show_check(recorded, checked, parameters.arm, options.json)
    tell_check(recorded, checked, parameters.arm, console.print)
    checked.require_safe()
    driver = _driver(options, parameters)
    require_yes(options.yes or options.to in (MOCK, FRANKA_SIM))
    return _execute(options, recorded, checked, parameters, driver)


def _parameters(options: ReplayOptions) -> PlayerParameters:
    """Parameters of the robot."""
    if options.to not in (FRANKA, FRANKA_SIM):
        return PlayerParameters(**parse_parameters(options.robot, PlayerParameters, "robot"))
    given = parse_parameters(options.robot, FrankaPlayerParameters, "robot")
    waiting = {**SLOW_CLOCK, **SIMULATED} if options.to == FRANKA_SIM else {}
    return FrankaPlayerParameters(**{**waiting, **given})


def _checked(recorded: RecordedMotion, parameters: PlayerParameters) -> DryRun:
    """The dry run: of a Franka arm by its own protocol, without stops."""
    limits = recorded.limits_of(parameters.limits)
    if not isinstance(parameters, FrankaPlayerParameters):
        return DryRun.of(recorded, limits)
    return blended_run(recorded, limits, parameters.speed)


def _driver(options: ReplayOptions, parameters: PlayerParameters) -> RobotDriver | None:
    """The node to start for the robot; None where its own controllers run.

    Raises:
        InvalidParameterError: A library that it needs is not installed, or the address is missing.
    """
    if options.to == MOCK:
        return RobotDriver(ensemble_replay.MOCK_ROBOT, parse_mock_robot(options.mock))
    if not isinstance(parameters, FrankaPlayerParameters):
        return None
    require_franky()
    told = {name: value for name, value in asdict(parameters).items() if name in TOLD_THE_DRIVER}
    if options.to == FRANKA_SIM:
        simulator_python()
        simulated = {"simulated": True, "realtime": False, "ip": ""}
        return RobotDriver(ensemble_replay.FRANKA_DRIVER, told | simulated)
    if not parameters.ip:
        raise InvalidParameterError("--to franka needs the robot's address: --robot ip=172.16.0.2")
    return RobotDriver(ensemble_replay.FRANKA_DRIVER, told, simulates=False)


def _execute(
    options: ReplayOptions,
    recorded: RecordedMotion,
    checked: DryRun,
    parameters: PlayerParameters,
    driver: RobotDriver | None,
) -> int:
    """Execute the motion; the exit code."""
    with counting_bars() as bar:
        watched = bar.add_task("replaying", total=len(recorded.waypoints))
        played = ensemble_replay.replay_on_robot(
            recorded, checked, parameters, driver, lambda done: bar.update(watched, completed=done)
        )
    reached = played.reached(recorded)
    if options.json:
        print_json(as_data(recorded, checked) | {"played": played.steps, "reached": reached})
    tell = console.print if options.json else print_result
    tell(f"{played.steps} steps executed; {REACHED[reached]}")
    return int(ErrorCode.REPLAY_MISMATCH) if reached is False else 0
