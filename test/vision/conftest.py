# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Camera and MuJoCo are extras: without them there is nothing to test here."""

import pytest

pytest.importorskip("pupil_apriltags")
pytest.importorskip("mujoco")
pytest.importorskip("pybullet")
