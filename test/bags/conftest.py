# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path

import pytest

from support.truthful_run import Script, record


@pytest.fixture(scope="session")
def honest_bag(script: Script, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """It, recorded. Shared: not to be changed."""
    path = tmp_path_factory.mktemp("bags") / "honest"
    record(path, script.messages)
    return path
