# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episodes as one table of comma-separated values."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import Any

from slap_ros.bags.episode_arrays import EpisodeArrays
from slap_ros.bags.export.episode_table import Columns, column_names, episode_tables


def write_csv(path: Path, episodes: Sequence[EpisodeArrays]) -> None:
    """Write a table, a row per state, with numbers that read back to the last bit.

    What an episode does not have, or what is not known, is an empty field.

    Args:
        path: Name of the file.
        episodes: What to write.

    Raises:
        InvalidParameterError: Two columns would have the same name.
        OSError: It cannot be written.
    """
    tables = episode_tables(episodes)
    names = column_names(tables)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for table in tables:
            writer.writerows(_rows(table, names))


def _rows(table: Columns, names: Sequence[str]) -> list[tuple[Any, ...]]:
    rows = len(table["step"])
    columns = (table[name].tolist() if name in table else [None] * rows for name in names)
    return list(zip(*([_field(value) for value in column] for column in columns), strict=True))


def _field(value: Any) -> Any:
    """Python writes a float with as many digits as it takes to read it back."""
    return "" if value is None or (isinstance(value, float) and isnan(value)) else value
