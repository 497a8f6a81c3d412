# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers, signals and YAML at random: refused or taken, within bounds, with a code."""

import random
import signal
import subprocess
import sys
import time

import pytest

from slap_ros.domains import get_domain
from slap_ros.domains.registry import OURS
from slap_ros.errors import InvalidParameterError
from slap_ros.files import parse_yaml
from support.process_state import handles_signals

pytestmark = pytest.mark.timeout(3600)  # for as many cases as somebody may ask for
LIMIT = 120.0  # s, far more than anything here takes
NUMBERS = (
    "nan",
    "inf",
    "-0",
    "1e-320",
    "1e308",
    "0x10",
    "1_0",
    "",
    " 3 ",
    "٣",
    "1..0",
    "..",
    "9" * 400,
)
COMMANDS = (("evaluate", "obstacle2d", "--tasks", "999"), ("check", "obstacle2d"), ("plan", "moon"))


@pytest.fixture
def count(request):
    return 3 + request.config.getoption("--fault-cases")


def test_settings_of_tasks(count):
    rng = random.Random(1)
    for _ in range(20 * count):
        name = rng.choice(sorted(OURS))  # others may be installed, and have no settings
        setting = rng.choice(sorted(get_domain(name).configuration))
        value = rng.choice(NUMBERS) or str(rng.lognormvariate(0, 20) * rng.choice((-1, 1)))
        try:
            assert get_domain(name, f"fair:{setting}={value}").name == name
        except InvalidParameterError as error:
            assert len(str(error)) < 400


def test_signals(tmp_path, count):
    rng = random.Random(2)
    for _ in range(count):
        command = [sys.executable, "-m", "ensemble.cli", *rng.choice(COMMANDS)]
        process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        while process.poll() is None and not handles_signals(process.pid):
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 1.5))
        number = rng.choice((signal.SIGINT, signal.SIGTERM))
        process.send_signal(number)
        told = process.communicate(timeout=LIMIT)[1]
        assert process.returncode in (128 + number, 10)  # the command may have ended
        assert "Traceback" not in told


def test_yaml(count):
    rng = random.Random(3)
    parts = (
        "a",
        ": ",
        "- ",
        "[",
        "]",
        "{",
        "}",
        "&x ",
        "*x",
        "<<",
        "!!int ",
        "!!set ",
        "\n",
        "  ",
        ",",
    )
    for _ in range(200 * count):
        text = "".join(rng.choice(parts) for _ in range(rng.randint(1, 40)))
        try:
            parse_yaml(text)
        except ValueError as error:
            assert str(error)
