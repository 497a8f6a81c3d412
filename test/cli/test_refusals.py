# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What cannot be is refused where it comes in, with a code, before anything is started."""

import math
import os
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import signature
from typing import get_args

import pytest

from ensemble.cli.application import COMMANDS
from ensemble.nodes import node_class
from ensemble.parameters import _require_within, parse_parameters
from ensemble.robot_parameters import MockRobotParameters, PlayerParameters, RobotBridgeParameters
from slap_ros.domains import get_domain
from slap_ros.domains.registry import OURS
from slap_ros.errors import ErrorCode, InvalidParameterError
from support.slap_command import slap

NO_NUMBERS = ("nan", "inf", "-inf", "1e400", "-1e400")
NO_SETTINGS = (*NO_NUMBERS, "9" * 400, "-" + "9" * 400, "9" * 5_000, "1e30", "-1e30", "nan..1")
NOWHERE = "/proc/no/such"  # nobody can write there, root included


def answer(*arguments):
    result = slap(*arguments)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


# -- settings of tasks ----------------------------------------------------------------------------


def settings_of(name):
    """The settings of a domain's presets."""
    package = import_module(f"slap_ros.domains.{name}")
    return (package if hasattr(package, "SETTINGS") else package.tasks).SETTINGS


def of_numbers(value):
    while isinstance(value, tuple):
        value = value[0]
    return isinstance(value, int | float)


@pytest.mark.parametrize("name", list(OURS))
def test_every_number_of_every_domain_has_limits(name):
    assert {"fair", "paper"} <= set(settings_of(name))
    for settings in settings_of(name).values():
        numbers = {f.name for f in fields(settings) if of_numbers(getattr(settings, f.name))}
        assert numbers == set(settings.limits), settings


@pytest.mark.parametrize("value", NO_SETTINGS, ids=lambda text: text[:12])
@pytest.mark.parametrize("name", list(OURS))
def test_a_setting_is_finite_and_within_its_limits(name, value):
    for preset, settings in settings_of(name).items():
        for setting in settings.limits:
            with pytest.raises(InvalidParameterError, match=setting) as caught:
                get_domain(name, f"{preset}:{setting}={value}")
            assert len(str(caught.value)) < 300


@pytest.mark.parametrize("name", list(OURS))
def test_what_is_within_the_limits_is_a_task_or_an_error(name, monkeypatch):
    # Where there is no room, thousands of scenes are drawn; here a few will do.
    for module in (f"{name}.tasks", "benchtop.tasks"):
        tasks = import_module(f"slap_ros.domains.{module}")
        if hasattr(tasks, "TRIES"):
            monkeypatch.setattr(tasks, "TRIES", 5)
    for setting, limits in settings_of(name)["fair"].limits.items():
        for number in limits:
            try:
                assert get_domain(name, f"fair:{setting}={number}").task(0).goal
            except InvalidParameterError as error:
                assert "room" in str(error)


# -- options and parameters -----------------------------------------------------------------------


def options_of(kind, commands=None, path=()):
    """Every command with its options that are of a kind, such as float."""
    for name, command in (commands or {one.name: one.load() for one in COMMANDS}).items():
        if hasattr(command, "commands"):
            yield from options_of(kind, command.commands, (*path, name))
            continue
        for option, parameter in signature(command.callback).parameters.items():
            if kind in kinds_in(parameter.annotation):
                yield (*path, name), f"--{option.replace('_', '-')}"


def kinds_in(annotation):
    """The types in an annotation such as ``Annotated[int | None, ...]``."""
    parts = get_args(annotation)[:1] or (annotation,)
    return {part for whole in parts for part in (whole, *get_args(whole))}


def test_every_option_that_is_a_number_is_finite():
    options = list(options_of(float))
    assert {option for _, option in options} >= {"--pace", "--timeout", "--seconds"}
    for path, option in options:
        for value in NO_NUMBERS:
            result = answer(*path, "obstacle2d", f"{option}={value}")
            assert result.exit_code in (2, ErrorCode.INVALID_PARAMETER), (path, option, value)


def test_every_option_that_is_a_whole_number_has_an_upper_end():
    options = list(options_of(int))
    assert {option for _, option in options} >= {"--tasks", "--seed", "--jobs", "--steps"}
    for path, option in options:
        result = answer(*path, "obstacle2d", f"{option}={'9' * 400}")
        assert result.exit_code in (2, ErrorCode.INVALID_PARAMETER), (path, option)


NODES = ("sim_node", "perception_node", "planner_node", "skill_server")


def parameter_kinds():
    """The dataclass of parameters in each node's module, and those of robots."""
    own = [
        kind
        for name in NODES
        for kind in vars(__import__(node_class(name).__module__, fromlist=["_"])).values()
        if is_dataclass(kind) and isinstance(kind, type) and kind.__name__.endswith("Parameters")
    ]
    return [*own, MockRobotParameters, PlayerParameters, RobotBridgeParameters]


def test_every_number_that_a_node_takes_is_finite_and_limited():
    numbers = [
        item
        for kind in parameter_kinds()
        for item in fields(kind)
        if of_numbers(item.default) and not isinstance(item.default, bool)
    ]
    assert len(numbers) > 30
    for item in numbers:
        low, high = item.metadata["low"], item.metadata["high"]
        _require_within(item.name, item.default, item.metadata)
        for value in (math.nan, math.inf, -math.inf, low - 1, high * 2, [low, math.nan]):
            with pytest.raises(InvalidParameterError, match=item.name):
                _require_within(item.name, value, item.metadata)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 1e-300])
def test_a_node_refuses_a_number_that_it_cannot_use(network, value):
    import rclpy
    from rclpy.parameter import Parameter

    rclpy.init()
    try:
        with pytest.raises(InvalidParameterError, match="pace"):
            node_class("sim_node")(parameter_overrides=[Parameter("pace", value=value)])
    finally:
        rclpy.shutdown()


@pytest.mark.parametrize("value", NO_NUMBERS)
@pytest.mark.parametrize("name", ["pace", "rate", "latency", "noise_seed"])
def test_parameters_on_the_command_line_are_finite(name, value):
    with pytest.raises(InvalidParameterError, match=name):
        parse_parameters(f"{name}={value}", MockRobotParameters, "mock robot")


# -- robots and outputs ---------------------------------------------------------------------------


def test_a_robot_is_for_domains_with_a_panda():
    for world in ("mock", "robot"):
        result = answer("run", "obstacle2d", "--world", world)
        assert result.exit_code == ErrorCode.INVALID_PARAMETER
        assert "no Panda" in result.stderr


@pytest.mark.parametrize("world", ["robot", "mujoco"])
def test_a_scene_that_cannot_be_read_starts_nothing(tmp_path, world):
    if world == "mujoco":
        pytest.importorskip("mujoco")
    scene = tmp_path / "scene.yaml"
    result = answer("run", "obstacle_tower", "--world", world, "--scene", scene)
    assert result.exit_code == ErrorCode.INVALID_SCENE
    (line,) = result.stderr.splitlines()  # no word of a node
    assert f"scene file {scene} cannot be read" in line


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "obstacle2d", "--record", NOWHERE),
        ("run", "obstacle_tower", "--render", f"{NOWHERE}.gif"),
        ("run", "obstacle2d", "--report", f"{NOWHERE}.html"),
        ("plan", "obstacle2d", "--output", NOWHERE),
        ("propose", "obstacle2d", "--output", NOWHERE),
        ("train", "obstacle2d", "--output", NOWHERE),
        ("train", "obstacle2d", "--output", "library", "--work", NOWHERE),
        ("study", "goals", "obstacle2d", "--output", NOWHERE),
        ("report", "bag", "--output", f"{NOWHERE}.html"),
        ("run", "obstacle2d", "--record", "file/below"),
        ("run", "obstacle_tower", "--render", "pipe.gif"),
        ("plan", "obstacle2d", "--output", "x" * 300),
        ("plan", "obstacle2d", "--output", "file"),
    ],
    ids=lambda arguments: " ".join(arguments)[:40],
)
def test_an_output_that_cannot_be_written_is_refused_before_the_run(
    tmp_path, monkeypatch, arguments
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe.gif")
    result = answer(*arguments)
    assert result.exit_code == ErrorCode.INPUT_OUTPUT, result.stderr
    assert len(result.stderr.strip().splitlines()) == 1  # no word of a run
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "pipe.gif"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--grow"], "domain obstacle2d does not say what skills are acquired with"),
        (["--shortcuts", "grown"], "need --grow"),
        (["--acquire", "--acquisition", "steps=nan"], "steps must be a whole number, not 'nan'"),
    ],
)
def test_what_a_run_could_not_learn_is_refused_before_it(options, words):
    refused = answer("run", "obstacle2d", "--in-process", *options)
    assert words in " ".join(refused.output.split())
    assert refused.exit_code in (ErrorCode.INVALID_DOMAIN, ErrorCode.INVALID_PARAMETER)
    assert "solved" not in refused.output
