# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Wheels that tests of a Franka arm need, and skip without."""

import os

import pytest

NO_WHEEL = "franky-control and franky-sim are not installed: pip install 'slap_ros[franka-sim]'"


def require_franky():
    """Skip without the client of Franka's protocol."""
    pytest.importorskip("franky", reason=NO_WHEEL)


def require_simulated_fr3():
    """Skip without that, or without the simulated robot."""
    require_franky()
    if "SLAP_FRANKA_SIM_PYTHON" not in os.environ:
        pytest.importorskip("franky_sim", reason=NO_WHEEL)
