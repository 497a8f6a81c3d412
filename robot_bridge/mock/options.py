# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The mock robot's parameters as a command line has them: ``latency=0.05,dropout=0.1``."""

from __future__ import annotations

from ensemble.parameters import parse_parameters
from robot_bridge.mock.node import Parameters

GIVEN = frozenset({"domain", "preset", "seed", "index"})  # with the run


def mock_options(text: str) -> dict[str, str | int | float]:
    """Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: One that there is not, or a value that it cannot have.
    """
    return parse_parameters(text, Parameters, "mock robot", GIVEN)
