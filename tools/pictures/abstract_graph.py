# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The abstract planning graph of a task of Obstacle 2D, with a shortcut on its plan.

The picture that ``slap plan obstacle2d --seed 5 --output FOLDER`` writes as ``graph.svg``.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from slap_ros.cli import app

ARGUMENTS = ("plan", "obstacle2d", "--seed", "5", "--output")


def make(path: Path) -> None:
    """Plan and keep the picture."""
    with TemporaryDirectory() as folder:
        app([*ARGUMENTS, folder], standalone_mode=False)
        path.write_bytes((Path(folder) / "graph.svg").read_bytes())
