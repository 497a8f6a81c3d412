# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scripted server and the paper's problems; and no key of the machine in any test."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from slap_ros.api import acquisition
from slap_ros.domains import forget_domains
from slap_ros.learning.workers import SequentialWorkers

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def no_settings_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("OPENAI_API_KEY", "SLAP_LANGUAGE_BASE_URL", "SLAP_LANGUAGE_MODEL")
    for name in (*names, "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)


@pytest.fixture
def points_installed(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """The domain `points` by its name, in this process and in those that it starts."""
    information = tmp_path_factory.mktemp("site") / "points-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Name: points\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(
        "[slap_ros.domains]\npoints = support.points:make\n"
    )
    folders = [str(information.parent), str(HERE.parent)]
    monkeypatch.syspath_prepend(folders[0])
    before = filter(None, [os.environ.get("PYTHONPATH")])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*folders, *before]))
    forget_domains()
    yield
    forget_domains()


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """`slap acquire` trains here: a process takes longer to import torch than what it does here."""
    monkeypatch.setattr(acquisition, "some_workers", lambda *_: nullcontext(SequentialWorkers()))
