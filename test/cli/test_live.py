# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a run looks like on a terminal while it goes, and where there is none."""

from __future__ import annotations

import io
import os
import pty
import random
import re
import subprocess
import sys

import pytest
from rich.console import Console

from ensemble.cli.live import RunView
from support.truthful_run import Published, Script

RUN = ["run", "obstacle2d", "--seed", "3", "--shortcuts", "none", "--in-process", "--live"]
RUN += ["--patience", "10"]  # for a loaded machine


def seen(messages: list[Published]) -> str:
    view, console = RunView(), Console(file=io.StringIO(), width=120)
    for item in messages:
        view.add(item.type_name, item.message)
    console.print(view)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def signs(text: str) -> str:
    return "".join(re.findall("^ *([▶✓✗·])", text, re.MULTILINE))


def test_at_the_end_every_option_has_its_steps(script: Script) -> None:
    text = seen(script.messages)
    options = script.truth.options
    assert f"step {script.truth.plan_length}  solved" in text
    assert signs(text) == "✓" * len(options)
    for option in options:
        name = re.escape(f"{option['name']}({', '.join(option['objects'])})")
        assert re.search(rf"{name} +{option['steps']} of \d+ steps", text)


def test_meanwhile_the_current_option_is_marked(script: Script) -> None:
    until = next(
        i
        for i, item in enumerate(script.messages)
        if item.topic == "/slap/state" and item.message.step == script.truth.options[0]["steps"] + 2
    )
    text = seen(script.messages[: until + 1])
    assert signs(text) == "✓▶" + "·" * (len(script.truth.options) - 2)
    assert re.search(r"▶.* 2 of \d+ steps", text)
    assert "+ " in text  # atoms changed


def test_the_order_of_topics_does_not_matter(script: Script) -> None:
    topics = sorted({item.topic for item in script.messages})
    random.Random(1).shuffle(topics)
    by_topic = [item for topic in topics for item in script.messages if item.topic == topic]
    assert seen(by_topic) == seen(script.messages)


def test_on_a_terminal_it_is_drawn_in_place(network: int) -> None:
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "ensemble.cli", *RUN]
    environment = os.environ | {"TERM": "xterm-256color", "COLUMNS": "100"}
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment) as process:
        os.close(theirs)
        written = b""
        try:
            while part := os.read(ours, 65536):
                written += part
        except OSError:
            pass  # how Linux says that the other side of a terminal was closed
        assert process.wait(200) == 0
    os.close(ours)
    text = written.decode()
    assert "\r\x1b[2K" in text  # what was drawn is erased and drawn again
    assert "\x1b[?25h" in text[text.rindex("\x1b[?25l") :]  # the cursor is back
    assert "solved" in text


@pytest.mark.slow
def test_without_a_terminal_there_are_plain_lines(network: int) -> None:
    command = [sys.executable, "-m", "ensemble.cli", *RUN]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert ran.returncode == 0, ran.stderr
    assert "\x1b" not in ran.stderr
    assert "reached after" in ran.stderr
