# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
import random
from pathlib import Path

import numpy as np
import pytest

from slap_ros.bags import Difference, replay_bag
from slap_ros.errors import DamagedBagError
from slap_ros.messages.interfaces import COMMAND, STATE
from support.truthful_run import Script, record, without


def test_an_honest_recording_is_reproduced(script: Script, honest_bag: Path) -> None:
    result = replay_bag(honest_bag)
    assert result.identical
    assert result.compared == script.truth.plan_length + 1
    assert result.unreached == 0
    assert result.damage is None


@pytest.mark.parametrize("bit", [0, 31, 63])
def test_one_flipped_bit_is_found(script: Script, tmp_path: Path, bit: int) -> None:
    messages = copy.deepcopy(script.messages)
    state = next(m.message for m in messages if m.type_name == STATE and m.message.step == 9)
    block = state.objects[1]
    before = float(block.features[0])
    block.features.view(np.uint64)[0] ^= np.uint64(1 << bit)
    record(tmp_path / "bag", messages)
    result = replay_bag(tmp_path / "bag")
    assert result.different == 1
    assert result.first == Difference(1, 9, block.name, "x", float(block.features[0]), before)


def test_a_tampered_command_is_found(script: Script, tmp_path: Path) -> None:
    """From there on every state is another one."""
    messages = copy.deepcopy(script.messages)
    command = next(m.message for m in messages if m.type_name == COMMAND and m.message.step == 1)
    command.deltas *= 0.5
    record(tmp_path / "bag", messages)
    result = replay_bag(tmp_path / "bag")
    assert result.first is not None and result.first.step == 2
    assert result.first.object == "robot"


def test_it_does_not_matter_which_of_two_commands_arrived_first(
    script: Script, tmp_path: Path
) -> None:
    messages, rng = list(script.messages), random.Random(5)
    places = [i for i, m in enumerate(messages) if m.type_name == COMMAND]
    commands = [messages[i] for i in places]
    rng.shuffle(commands)
    for place, command in zip(places, commands, strict=True):
        messages[place] = command
    record(tmp_path / "bag", messages)
    assert replay_bag(tmp_path / "bag") == replay_bag_of(script, tmp_path)


def replay_bag_of(script: Script, tmp_path: Path) -> object:
    record(tmp_path / "again", script.messages)
    return replay_bag(tmp_path / "again")


def test_a_lost_state_is_stepped_over(script: Script, tmp_path: Path) -> None:
    messages = [m for m in script.messages if m.type_name != STATE or m.message.step != 4]
    record(tmp_path / "bag", messages)
    result = replay_bag(tmp_path / "bag")
    assert result.identical
    assert result.compared == script.truth.plan_length


def test_after_lost_commands_it_goes_on_from_what_was_recorded(
    script: Script, tmp_path: Path
) -> None:
    messages = [m for m in script.messages if m.type_name != COMMAND or m.message.step >= 6]
    record(tmp_path / "bag", messages)
    result = replay_bag(tmp_path / "bag")
    assert result.identical
    assert result.unreached == 6


def test_without_the_task_it_starts_from_the_first_state(script: Script, tmp_path: Path) -> None:
    messages = without(script.messages, "/slap/task")
    messages = [m for m in messages if m.type_name != STATE or m.message.step >= 3]
    record(tmp_path / "bag", messages)
    result = replay_bag(tmp_path / "bag")
    assert result.identical
    assert result.compared == script.truth.plan_length - 2


def test_without_the_domain_there_is_no_world(script: Script, tmp_path: Path) -> None:
    record(tmp_path / "bag", without(script.messages, "/slap/domain"))
    with pytest.raises(DamagedBagError, match="domain"):
        replay_bag(tmp_path / "bag")
