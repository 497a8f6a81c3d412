# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which cases of a test are slow: `make test-all` runs all, `make test` one that is like them."""

from typing import Any

import pytest


def slow(*values: Any) -> list[Any]:
    """The values of a parameter, or of several in a tuple, with which a test is slow."""
    return [
        pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.slow)
        for value in values
    ]
