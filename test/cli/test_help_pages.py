# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every command's help ends with an example that the command understands."""

import re
import shlex

import pytest

from ensemble.cli.application import COMMANDS
from slap_ros.cli.help_pages import PANELS
from support.slap_command import slap


def leaves(command, path):
    inner = getattr(command, "commands", {})
    if not inner:
        yield path, command
    for name, one in inner.items():
        yield from leaves(one, f"{path} {name}")


@pytest.fixture(scope="module")
def commands():
    return {path: one for entry in COMMANDS for path, one in leaves(entry.load(), entry.name)}


def test_every_command_has_an_example_that_it_understands(commands):
    for path, command in commands.items():
        assert command.epilog, path
        words = shlex.split(command.epilog.removeprefix("Example: "))
        depth = 2 + path.count(" ")
        said, arguments = words[:depth], words[depth:]
        assert " ".join(said) == f"slap {path}"
        command.make_context(path, arguments)


def test_every_panel_is_of_an_option_that_there_is(commands):
    names = {parameter.name for command in commands.values() for parameter in command.params}
    assert PANELS.keys() <= names


@pytest.mark.parametrize("command", ["run", "plan", "evaluate", "train"])
def test_help_names_no_number_that_nobody_would_give(command):
    shown = slap(command, "--help", COLUMNS="100").stdout
    assert "Task" in shown
    assert f"Example: slap {command}" in shown
    assert not re.search(r"\d{8,}", shown)


def test_a_seed_beyond_what_messages_hold_is_refused():
    answer = slap("run", "obstacle2d", "--seed", 2**63)
    assert answer.exit_code == 2
    assert f"{2**63} is too large" in " ".join(answer.stderr.split())
