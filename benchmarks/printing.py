# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the benchmarks print their figures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def show(figures: Mapping[str, Any], as_json: bool) -> None:
    """A line for each row of figures; or all as JSON."""
    if as_json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        row = value if isinstance(value, Mapping) else {"": value}
        print(name.ljust(20), "  ".join(f"{key} {figure:.6g}" for key, figure in row.items()))
