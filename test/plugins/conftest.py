# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Domains of other distributions, installed for one test."""

import os
import sys
from pathlib import Path

import pytest

from slap_ros.domains import forget_domains


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Installs a distribution: entry points by name, and modules by their text.

    It is seen in this process and in those that it starts.
    """
    folders, before = [], os.environ.get("PYTHONPATH")

    def install(entry_points, distribution="strangers", **modules):
        folder = tmp_path / "site" / distribution
        information = folder / f"{distribution}-1.0.dist-info"
        information.mkdir(parents=True)
        lines = [f"{name} = {value}\n" for name, value in entry_points.items()]
        (information / "METADATA").write_text(f"Name: {distribution}\nVersion: 1.0\n")
        (information / "entry_points.txt").write_text("[slap_ros.domains]\n" + "".join(lines))
        for name, text in modules.items():
            (folder / f"{name}.py").write_text(text)
            monkeypatch.delitem(sys.modules, name, raising=False)
        folders.append(folder)
        monkeypatch.syspath_prepend(folder)
        path = [*map(str, folders), str(Path(__file__).parents[1])]
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*path, *filter(None, [before])]))
        forget_domains()

    yield install
    forget_domains()
