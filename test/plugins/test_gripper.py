# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's gripper may be any axis, close either way, or not be there."""

import numpy as np
import pytest

from ensemble import encode
from ensemble.nodes import RunSettings
from ensemble.run import RunRequest, run
from slap_ros.bags import evaluate_bag, read_bag, replay_bag
from slap_ros.core import ActionSpace, GripperAxis
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidCommandError, InvalidDomainError
from slap_ros.messages.decode import decode_command
from slap_ros.messages.interfaces import COMMAND, DOMAIN_INFO
from slap_ros.policies.action_map import ActionMap
from slap_ros.relational import Feature
from slap_ros.shortcuts.exploration_policies import RandomExploration
from slap_ros.shortcuts.exploration_settings import ExplorationSettings
from slap_ros.shortcuts.explorer import Explorer
from slap_ros.skills.domain_choice import DomainChoice
from support import gripper_first, sweeping

FLAT = get_domain("obstacle2d", "fair")
SWEEPING, FIRST = sweeping.make(), gripper_first.make()
DOMAINS = (FLAT, FIRST, SWEEPING)


def axes(*names):
    return tuple(Feature(name, "m") for name in names)


@pytest.mark.parametrize(
    ("gripper", "low", "words"),
    [
        (GripperAxis("hand"), -1.0, "the gripper is to be the axis 'hand'; there are x, grip"),
        (GripperAxis("grip", closes=2.0), -1.0, "closes the gripper at 2.0"),
        (GripperAxis("grip", closes=0.5, opens=0.2), -1.0, "one must be above 0"),
        (GripperAxis("grip", closes=float("nan")), -1.0, "closes the gripper at nan"),
        (None, 0.5, "axis x of the action space: 0, which is to move nothing"),
        (None, float("nan"), "axis x of the action space: 0, which is to move nothing"),
    ],
)
def test_an_action_space_whose_parts_do_not_fit_is_refused(gripper, low, words):
    with pytest.raises(InvalidDomainError, match=words):
        ActionSpace(axes("x", "grip"), (low, -1.0), (1.0, 1.0), gripper)


def test_limits_of_another_number_are_refused():
    with pytest.raises(InvalidDomainError, match=r"2 axes .* has 1 lower and 2 upper"):
        ActionSpace(axes("x", "y"), (-1.0,), (1.0, 1.0))


def test_learned_actions_with_another_gripper_are_refused():
    from dataclasses import replace

    other = replace(FLAT.action_space, gripper=None)
    with pytest.raises(InvalidDomainError, match="another gripper than the robot"):
        replace(FLAT, learning=replace(FLAT.learning, actions=other))


@pytest.mark.parametrize("domain", DOMAINS, ids=lambda domain: domain.name)
def test_a_command_that_was_sent_is_the_action_that_arrives(domain):
    space, rng = domain.action_space, np.random.default_rng(0)
    stamp = encode.domain_info(FLAT, None).header.stamp
    for action in rng.uniform(space.low, space.high, (50, len(space.axes))):
        message = encode.command(action, space, 1, 0, stamp)
        assert decode_command(message, space).tobytes() == action.tobytes()
    names = list(encode.domain_info(domain, stamp).action_names)
    assert names == {"sweeping": ["x", "y"]}.get(domain.name, ["x", "y"])
    assert len(message.deltas) == len(names)


def test_a_gripper_that_is_not_there_cannot_be_commanded():
    message = encode.command(np.zeros(2), SWEEPING.action_space, 1, 0, None)
    assert message.gripper == 0.0
    for command in (1.0, float("nan")):
        message.gripper = command
        with pytest.raises(InvalidCommandError, match="this robot has none"):
            decode_command(message, SWEEPING.action_space)


def test_deltas_that_are_too_few_are_refused_wherever_the_gripper_is():
    for domain in DOMAINS:
        message = encode.command(domain.action_space.hold, domain.action_space, 1, 0, None)
        message.deltas = message.deltas[:-1]
        with pytest.raises(InvalidCommandError, match="a command has"):
            domain.action_space.check(decode_command(message, domain.action_space))


def test_a_policy_moves_all_that_is_no_gripper():
    policy = np.random.default_rng(0).uniform(-1, 1, (20, 2))
    for domain in DOMAINS:
        action_map = ActionMap(domain, gripper=False)
        assert action_map.size == 2
        for action, own in zip(action_map(policy), policy, strict=True):
            displacement, command = domain.action_space.split(action)
            assert displacement.tolist() == (0.1 * own).tolist()
            assert command == 0.0
    assert ActionMap(SWEEPING, gripper=True).size == 2
    assert ActionMap(FIRST, gripper=True)(np.array([1.0, 0.0, 0.0]))[0] == gripper_first.WIDTH


def explorer(domain):
    settings = ExplorationSettings(rollouts=64, length=30, nodes=3)
    return Explorer.of_task(domain, 0, 0, settings, np.random.default_rng(0))


def test_random_rollouts_close_and_open_the_axis_that_is_the_gripper():
    drawing = RandomExploration(FIRST, 64, 1, np.random.default_rng(0))
    drawn = np.concatenate([drawing.actions(step) for step in range(100)])
    commands, counts = np.unique(drawn[:, 0], return_counts=True)
    assert commands.tolist() == [-gripper_first.WIDTH, 0.0, gripper_first.WIDTH]
    assert counts / len(drawn) == pytest.approx([0.1, 0.8, 0.1], abs=0.05)
    for column in drawn.T[1:]:
        assert len(np.unique(column)) == len(drawn)


def test_without_a_gripper_every_axis_explores():
    drawn = RandomExploration(SWEEPING, 64, 1, np.random.default_rng(0)).actions(0)
    assert len(np.unique(drawn)) == drawn.size
    found = explorer(SWEEPING).explore()
    assert any(candidate.expected_saving > 0.0 for candidate in found.candidates)


@pytest.mark.parametrize("name", ["sweeping", "gripper_first"])
def test_the_ensemble_runs_records_and_replays_it(name, network, tmp_path, install):
    install({name: f"support.{name}:make"})
    bag = str(tmp_path / "bag")
    settings = RunSettings(
        DomainChoice(name, "default"), 3, 0, "lazy", bag, shortcuts="none", patience=5.0
    )
    result = run(RunRequest(settings, timeout_s=200, in_process=True), lambda *_: None)
    assert result.success
    assert replay_bag(tmp_path / "bag").identical
    (metrics,) = evaluate_bag(tmp_path / "bag").runs
    assert metrics.success
    messages = [(m.type_name, m.message) for m in read_bag(tmp_path / "bag")]
    (info,) = [message for kind, message in messages if kind == DOMAIN_INFO]
    commands = [message for kind, message in messages if kind == COMMAND]
    assert len(commands) == metrics.plan_length
    assert {len(command.deltas) for command in commands} == {len(info.action_names)}
    grips = {command.gripper for command in commands}
    width = gripper_first.WIDTH
    assert grips == ({0.0} if name == "sweeping" else {0.0, -width, width})
