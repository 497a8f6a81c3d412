# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A hand among the things of the workbench."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.fixture
def world():
    """The bench, with the hand above it."""
    from benchmarks.workbench import BENCH, start
    from slap_ros.worlds.contact.world import ContactWorld

    with ContactWorld(BENCH, start()) as world:
        yield world
