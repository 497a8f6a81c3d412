# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Modules of this package as programs of their own."""

import os
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
PATH = os.pathsep.join([str(TESTS.parent), str(TESTS)])  # of benchmarks, and of this package


def environment() -> dict[str, str]:
    """The environment of such a program: this process's, with the modules that it imports."""
    before = filter(None, [os.environ.get("PYTHONPATH")])
    return os.environ | {"PYTHONPATH": os.pathsep.join([PATH, *before])}


def program(name: str) -> list[str]:
    """The command that runs a module of this package; give it :func:`environment`."""
    return [sys.executable, "-m", f"support.{name}"]
