# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bullet is an extra: without it there is nothing to test here."""

import pytest

pytest.importorskip("pybullet")
