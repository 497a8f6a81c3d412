# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A study is a file: what it says of itself is its command, and no other file repeats it."""

import shlex
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from pkgutil import iter_modules

import pytest
from typer.main import get_command

from slap_ros.cli.study import app
from slap_ros.studies import lg_sail, slap
from slap_ros.studies.registry import STUDIES
from slap_ros.studies.study import Study
from tools.reproduce import figures

COMMANDS = get_command(app).commands


def studies_of_files():
    for room in (slap, lg_sail):
        for module in iter_modules(room.__path__):
            made = import_module(f"{room.__name__}.{module.name}")
            yield from (one for one in vars(made).values() if isinstance(one, Study))


def test_every_study_of_a_file_is_in_the_registry():
    assert {study.name: study for study in studies_of_files()} == STUDIES


def test_every_study_is_a_command_with_the_words_and_options_of_its_file():
    assert list(COMMANDS) == [*STUDIES, "readme"]
    for name, study in STUDIES.items():
        command = COMMANDS[name]
        assert command.help == study.help
        assert study.example in command.epilog
        defaults = {field.name: field.default for field in fields(study.options)}
        given = {one.name: one.default for one in command.params if not one.required}
        assert given.items() <= defaults.items() | {("help", False)}
        assert {one.name for one in command.params} - {"help"} == set(defaults)


@pytest.mark.parametrize("figure", figures(), ids=lambda figure: figure.name)
def test_the_command_of_a_page_has_options_that_there_are(figure):
    _, _, study, *arguments = shlex.split(figure.command)
    COMMANDS[study].make_context(study, arguments)


def test_studies_need_no_command_line():
    code = (
        "import sys, slap_ros.studies.registry; "
        "print([name for name in ('typer', 'rich', 'slap_ros.cli') if name in sys.modules])"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert printed.stdout == "[]\n", printed.stderr
