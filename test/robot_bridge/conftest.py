# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bullet is an extra: without it there is nothing to test here."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("pybullet")
sys.path.insert(0, str(Path(__file__).parent.parent / "faults"))  # for the helpers of those tests
