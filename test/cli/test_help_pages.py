# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every command's help ends with an example that the command understands."""

import re
import shlex
from pathlib import Path

import pytest

from ensemble.cli.application import COMMANDS
from slap_ros.cli.help_pages import PANELS
from support.slap_command import slap

ROOT = Path(__file__).parents[2]


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


def test_every_command_on_a_page_is_understood(commands):
    """Lines of code alone: a command in a sentence may lack what the sentence is not about."""
    wrong = []
    for page in (ROOT / "README.md", *ROOT.glob("docs/*.md")):
        text = re.sub(r"\\\n\s*", " ", page.read_text(encoding="utf-8"))
        for line in re.findall(r"^    slap (.*)$", text, re.MULTILINE):
            words = shlex.split(line, comments=True)
            path = next(p for p in (" ".join(words[:2]), words[0]) if p in commands)
            try:
                commands[path].make_context(path, words[1 + path.count(" ") :])
            except Exception as error:
                wrong.append(f"{page.name}: slap {line}: {error}")
    assert not wrong


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
