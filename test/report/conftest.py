# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path

import pytest

from support.staged_runs import HOSTILE, hostile, tower, with_a_shortcut, with_markers
from support.truthful_run import Script, record


@pytest.fixture(scope="session")
def bags(script: Script, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Recorded runs by what they are. Shared: not to be changed."""
    folder = tmp_path_factory.mktemp("bags")
    pure = with_markers(script)
    learned = with_a_shortcut(script)
    messages = {
        "pure": pure,
        "learned": learned,
        "hostile": hostile(learned, HOSTILE),
        "harmless": hostile(learned, ["harmless"]),
        "tower": tower(),
    }
    for name, published in messages.items():
        record(folder / name, published)
    return {name: folder / name for name in messages}
