# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Episodes as one Parquet table, with units and everything else in its metadata."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from slap_ros.bags.episode_arrays import EpisodeArrays
from slap_ros.bags.export.episode_table import column_units, episode_tables

METADATA_KEY = "slap_ros"  # of the schema: a JSON list of what there is to say of each episode


def write_parquet(path: Path, episodes: Sequence[EpisodeArrays]) -> None:
    """Write a table, a row per state; what an episode does not have is null.

    Columns carry their ``unit`` as metadata.

    Args:
        path: Name of the file.
        episodes: What to write.

    Raises:
        InvalidParameterError: Two columns would have the same name.
        OSError: It cannot be written.
    """
    import pyarrow
    from pyarrow import parquet

    tables = [
        pyarrow.table({name: pyarrow.array(column) for name, column in table.items()})
        for table in episode_tables(episodes)
    ]
    table = pyarrow.concat_tables(tables, promote_options="default")
    units = column_units(episodes)
    fields = [
        field.with_metadata({"unit": units[field.name]}) if field.name in units else field
        for field in table.schema
    ]
    about = json.dumps([episode.about() for episode in episodes], allow_nan=False)
    parquet.write_table(table.cast(pyarrow.schema(fields, {METADATA_KEY: about})), path)
